"""What a command reads is not what it writes."""

from __future__ import annotations

from pathlib import Path

from bridge.log.reader import LogReader
from tracker.errors import OperatorError


def keep(inputs: tuple[Path, ...], out: Path | None, what: str) -> None:
    """Refuse to write over a file that the same command reads, whatever else may be replaced; devices hold nothing.

    Args:
        inputs: the files it reads, there or not.
        out: the file it is to write, None for none.
        what: the option that names it.
    Raises:
        OperatorError: the output is one of the inputs, by whatever path.
    """
    for each in inputs:
        if out is not None and are_one(each, out):
            raise OperatorError(f"{what} {out}: this command goes by that file, which is kept; name another")


def keep_flight(log: Path, source: str) -> None:
    """Refuse to replace a log that is there already, unless it is one of the same source, or empty.

    Args:
        log: where a log is to be written without asking.
        source: what the logs that may be replaced were recorded from, as they themselves say.
    Raises:
        OperatorError: the log of another flight, or a file that is no log.
    """
    if not log.is_file() or not log.stat().st_size:
        return
    flown = LogReader(log).metadata().get("run", {}).get("source", "nobody knows what")
    if flown != source:
        raise OperatorError(f"log {log}: is of another flight ({flown}) and is kept; name another folder")


def are_one(one: Path, other: Path) -> bool:
    """Say whether two paths lead, or would lead, to the same file; a device is never one."""
    if one.exists() and other.exists():
        return one.is_file() and one.samefile(other)
    return one.resolve() == other.resolve()
