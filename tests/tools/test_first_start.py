"""A first start that takes a minute says why; every later one is silent."""

from __future__ import annotations

import gc
import importlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numba
import pytest

from tools.first_start import tell_of_compiling

SOURCE = "def double(x):\n    return x + x\n"
MODULE = "doubled_in_a_test"


@pytest.fixture
def told() -> Iterator[list[str]]:
    lines: list[str] = []
    stop = tell_of_compiling(lines.append)
    yield lines
    stop()


@pytest.fixture
def double_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], Callable[[float], float]]:
    """A function that loads another from its file as a new process would, with nothing of the last load left.

    It is a module's, for Numba finds what it kept by importing that again.
    """
    (tmp_path / f"{MODULE}.py").write_text(SOURCE, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)

    def load() -> Callable[[float], float]:
        monkeypatch.delitem(sys.modules, MODULE, raising=False)
        gc.collect()
        double: Callable[[float], float] = importlib.import_module(MODULE).double
        return double

    return load


def test_compiling_is_told_once_and_what_is_in_the_cache_not_at_all(
    told: list[str], double_anew: Callable[[], Callable[[float], float]]
) -> None:
    for _ in range(2):
        numba.njit("f8(f8)", cache=True)(double_anew())
    assert told == ["compiling the image kernels once; this takes about a minute"]
    told.clear()
    silent: list[str] = []
    stop = tell_of_compiling(silent.append)
    numba.njit("f8(f8)", cache=True)(double_anew())
    stop()
    assert silent == []


def test_where_nothing_can_be_kept_the_remedy_is_told(
    told: list[str], double_anew: Callable[[], Callable[[float], float]]
) -> None:
    for signature in ("f8(f8)", "f4(f4)"):
        numba.njit(signature)(double_anew())
    (line,) = told
    assert "at each start" in line
    assert "NUMBA_CACHE_DIR" in line
