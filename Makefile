# Needs python3 (3.11 or newer, with venv) and make. Everything else goes into .venv.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Tests receive with it. Its own requirements are left out: since this version they hold VTK and the OpenCV with windows,
# whose files overwrite those of the headless one; as a plain receiver it needs none of them, and pymavlink is there.
MAVPROXY := MAVProxy==1.8.75
STAMP := $(VENV)/.installed

# Options of the demo: make demo DURATION_S=20 SEED=3 OUT=logs/demo PACE=fast
DEMO_OPTIONS = $(if $(DURATION_S),--duration_s $(DURATION_S)) $(if $(SEED),--seed $(SEED)) \
	$(if $(OUT),--out $(OUT)) $(if $(PACE),--pace $(PACE))
# By file, so that tests that share a costly fixture share it in one process.
PYTEST_OPTIONS ?= --numprocesses auto --maxprocesses 4 --dist loadfile

.PHONY: demo test lint venv clean

demo: venv
	$(BIN)/posebridge demo $(DEMO_OPTIONS)

test: lint
	$(BIN)/python -m pytest $(PYTEST_OPTIONS)

lint: venv
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

venv: $(STAMP)

# Built anew when the dependencies change, so that it never holds more than pyproject.toml names.
$(STAMP): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "posebridge needs Python 3.11 or newer; \
	this is %d.%d: name another, make PYTHON=python3.12" % sys.version_info[:2])'
	$(PYTHON) -m venv --clear $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps '$(MAVPROXY)'
	@touch $@

clean:
	rm -rf $(VENV) build *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find tracker bridge config tools tests -name __pycache__ -type d -prune -exec rm -rf {} +
