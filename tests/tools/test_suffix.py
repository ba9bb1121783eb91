"""What is written has the name of its kind, and who asks for another is told before any work is done."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.bridge.recordings import record, turns
from tools.cli import EXIT_OPERATOR, run_command_line
from tools.suffix import check_suffix
from tracker.errors import OperatorError


@pytest.mark.parametrize(
    ("arguments", "suffix"),
    [
        ("calibrate board --out OUT", ".pdf"),
        ("calibrate intrinsics --source images:nowhere --picture OUT", ".png"),
        ("colours --source sim:hover --picture OUT", ".png"),
        ("compare LOG LOG --out OUT", ".png"),
        ("sysid LOG --out OUT", ".html"),
        ("excite --out OUT", ".toml"),
    ],
)
@pytest.mark.parametrize("name", ["sheet.txt", "sheet"])
def test_another_suffix_is_refused_in_one_line_and_nothing_is_written(
    arguments: str, suffix: str, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record(tmp_path / "flight.mcap", turns(3))
    out = tmp_path / name
    typed = arguments.replace("OUT", str(out)).replace("LOG", str(tmp_path / "flight.mcap")).split()
    assert run_command_line(typed) == EXIT_OPERATOR
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert f"{out}: only {suffix[1:].upper()} is written there; give a name that ends in {suffix}" in error
    assert [each.name for each in tmp_path.iterdir()] == ["flight.mcap"]


def test_capitals_pass_and_devices_and_pipes_are_called_as_they_are(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    check_suffix(tmp_path / "BOARD.PDF", "--out", ".pdf")
    check_suffix(tmp_path / "pipe", "--out", ".pdf")
    check_suffix(Path("/dev/null"), "--out", ".pdf")
    check_suffix(None, "--out", ".pdf")
    with pytest.raises(OperatorError, match="--out"):
        check_suffix(tmp_path / "pipe2", "--out", ".pdf")
