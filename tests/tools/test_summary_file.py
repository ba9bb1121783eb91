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
    check_summary_path(path, overwrite=False)
    write_summary(path, Summary(3, 15.0))
    assert json.loads(path.read_text(encoding="utf-8"))["estimates_sent"] == 3


def test_a_summary_that_exists_is_kept_unless_it_may_be_replaced(tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    path.touch()
    check_summary_path(path, overwrite=True)
    with pytest.raises(OperatorError, match="the file exists and is kept"):
        check_summary_path(path, overwrite=False)


def test_a_summary_that_could_not_be_written_is_refused_at_once(tmp_path: Path) -> None:
    with pytest.raises(OperatorError, match="is a directory"):
        check_summary_path(tmp_path, overwrite=True)
    with pytest.raises(OperatorError, match="does not exist; create it"):
        check_summary_path(tmp_path / "gone" / "run.json", overwrite=False)


def test_a_device_takes_a_summary_without_being_replaced() -> None:
    check_summary_path(Path("/dev/null"), overwrite=False)


def test_a_full_disk_is_told_in_one_line() -> None:
    with pytest.raises(OperatorError, match="No space left on device"):
        write_summary(Path("/dev/full"), Summary(3, 15.0))
