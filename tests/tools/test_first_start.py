"""A first start that takes a minute says why; every later one is silent."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numba
import pytest

from tools.first_start import tell_of_compiling

SOURCE = "def double(x):\n    return x + x\n"


@pytest.fixture
def told() -> Iterator[list[str]]:
    lines: list[str] = []
    stop = tell_of_compiling(lines.append)
    yield lines
    stop()


def double_of(folder: Path) -> Callable[[float], float]:
    """Load a function from a file, as a new process would."""
    path = folder / "double.py"
    path.write_text(SOURCE, encoding="utf-8")
    names: dict[str, Any] = {"__name__": "double", "__file__": str(path)}
    exec(compile(SOURCE, str(path), "exec"), names)
    double: Callable[[float], float] = names["double"]
    return double


def test_compiling_is_told_once_and_what_is_in_the_cache_not_at_all(told: list[str], tmp_path: Path) -> None:
    for _ in range(2):
        numba.njit("f8(f8)", cache=True)(double_of(tmp_path))
    assert told == ["compiling the image kernels once; this takes about a minute"]
    told.clear()
    silent: list[str] = []
    stop = tell_of_compiling(silent.append)
    numba.njit("f8(f8)", cache=True)(double_of(tmp_path))
    stop()
    assert silent == []


def test_where_nothing_can_be_kept_the_remedy_is_told(told: list[str], tmp_path: Path) -> None:
    for signature in ("f8(f8)", "f4(f4)"):
        numba.njit(signature)(double_of(tmp_path))
    (line,) = told
    assert "at each start" in line
    assert "NUMBA_CACHE_DIR" in line
