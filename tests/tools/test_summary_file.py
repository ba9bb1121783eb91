"""The summary's file: refused before the flight or written after it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from bridge.summary import Summary
from tools.summary_file import check_summary_path, write_summary
from tracker.errors import OperatorError


def test_a_summary_is_written_where_it_was_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    check_summary_path(path)
    write_summary(path, Summary(3, 15.0))
    assert json.loads(path.read_text(encoding="utf-8"))["estimates_sent"] == 3


def test_a_summary_that_exists_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    path.write_text("old", encoding="utf-8")
    check_summary_path(path)
    write_summary(path, Summary(3, 15.0))
    assert json.loads(path.read_text(encoding="utf-8"))["rate_hz"] == 15.0


def test_a_summary_that_could_not_be_written_is_refused_at_once(tmp_path: Path) -> None:
    with pytest.raises(OperatorError, match="is a directory"):
        check_summary_path(tmp_path)
    with pytest.raises(OperatorError, match="does not exist; create it"):
        check_summary_path(tmp_path / "gone" / "run.json")


def test_a_device_takes_a_summary_without_being_replaced() -> None:
    check_summary_path(Path("/dev/null"))


def test_a_full_disk_is_told_in_one_line(full_disk: Path) -> None:
    with pytest.raises(OperatorError, match="No space left on device"):
        write_summary(full_disk, Summary(3, 15.0))
