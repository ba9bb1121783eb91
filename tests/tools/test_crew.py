"""Work done side by side, and how it ends early."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tools.bench.crew import side_by_side

ROOT = Path(__file__).parents[2]


def test_an_error_of_one_is_raised() -> None:
    with pytest.raises(ValueError, match="invalid literal"):
        side_by_side(int, ("1", "two", "3"))


def test_ctrl_c_at_a_terminal_ends_all_of_them_quietly() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.tools.crew_process"],
        cwd=ROOT, start_new_session=True, capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (0, "interrupted\n", "")
