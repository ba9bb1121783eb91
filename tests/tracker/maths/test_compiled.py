"""Compiled code and what it is kept for."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

CALLEE = """
from tracker.maths.compiled import compiled

STEP = {step}


@compiled("i8(i8)", inline={inline})
def more(x):
    return x + {more}
"""
CALLER = """
from kept_callee import STEP, more

from tracker.maths.compiled import compiled


@compiled("i8(i8)")
def result(x):
    return STEP * more(x)
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "kept_caller.py").write_text(CALLER)
    yield tmp_path
    for name in ("kept_callee", "kept_caller"):
        sys.modules.pop(name, None)


def loaded(folder: Path, step: int, more: int, *, inline: bool = False) -> ModuleType:
    """Write the callee, and load both as a new start of the program would."""
    (folder / "kept_callee.py").write_text(CALLEE.format(step=step, more=more, inline=inline))
    importlib.invalidate_caches()
    for name in ("kept_callee", "kept_caller"):
        sys.modules.pop(name, None)
    return importlib.import_module("kept_caller")


def test_code_is_kept_for_the_next_start(folder: Path) -> None:
    loaded(folder, 1, 1)
    kept = {path: path.stat().st_mtime_ns for path in folder.rglob("kept_caller*.nbc")}
    assert kept
    assert loaded(folder, 1, 1).result(5) == 6
    assert kept == {path: path.stat().st_mtime_ns for path in folder.rglob("kept_caller*.nbc")}


@pytest.mark.parametrize("inline", [False, True])
@pytest.mark.parametrize(("step", "more", "expected"), [(1, 30, 35), (20, 1, 120)])
def test_a_change_in_another_file_that_the_code_is_made_of_is_noticed(
    folder: Path, step: int, more: int, expected: int, inline: bool
) -> None:
    assert loaded(folder, 1, 1, inline=inline).result(5) == 6
    assert loaded(folder, step, more, inline=inline).result(5) == expected
