"""The file a run's figures go to."""

from __future__ import annotations

from pathlib import Path

from bridge.summary import Summary, to_json
from tracker.errors import OperatorError


def check_summary_path(path: Path) -> None:
    """Find out before the flight that the summary could not be written after it.

    One that is there already is replaced: it only repeats what the log holds.

    Raises:
        OperatorError: a directory, or one in a directory that does not exist.
    """
    if path.is_dir():
        raise OperatorError(f"--summary {path}: is a directory; name a file in it")
    if not path.parent.is_dir():
        raise OperatorError(f"--summary {path}: the directory {path.parent} does not exist; create it")


def write_summary(path: Path, summary: Summary) -> None:
    """Write the summary as JSON.

    Raises:
        OperatorError: the file cannot be written.
    """
    try:
        path.write_text(to_json(summary), encoding="utf-8")
    except OSError as error:
        raise OperatorError(f"--summary {path}: cannot be written ({error.strerror}); name a writable path") from error
