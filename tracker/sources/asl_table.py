"""The comma-separated tables of a recording in EuRoC/ASL layout."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tracker.errors import OperatorError

LATEST_NS = 2**63 - 1


@dataclass(frozen=True, slots=True)
class Row:
    """One line of a table. where: file and line, for messages.  t_ns: its first column [ns].  fields: the others."""

    where: str
    t_ns: int
    fields: tuple[str, ...]


def read_rows(path: Path, columns: int) -> Iterator[Row]:
    """Read a table line by line; a header, empty lines and columns beyond the wanted ones do not matter.

    Args:
        columns: how many columns each line must have at least, the time among them.
    Raises:
        OperatorError: no such file, or a line that is not a time in nanoseconds and enough fields.
    """
    for number, line in enumerate(_lines(path), start=1):
        if not line or line.startswith("#") or (number == 1 and line.startswith("timestamp")):
            continue
        where = f"{path} line {number}"
        first, *fields = (field.strip() for field in line.split(","))
        if len(fields) < columns - 1 or not all(fields[: columns - 1]):
            raise OperatorError(f"{where}: {line!r} must have {columns} columns; mend or remove the line")
        if not (first.isascii() and first.isdecimal() and int(first) <= LATEST_NS):
            raise OperatorError(
                f"{where}: time {first!r} must be whole nanoseconds, 0 to {LATEST_NS}; mend or remove the line"
            )
        yield Row(where, int(first), tuple(fields))


def _lines(path: Path) -> list[str]:
    """Return the stripped lines; bytes that are no text make a line that is refused with its number."""
    try:
        text = path.read_bytes().decode("utf-8-sig", errors="replace")
    except OSError as error:
        raise OperatorError(
            f"{path}: cannot be read ({error.strerror}); a recording in EuRoC/ASL layout needs it"
        ) from error
    return [line.strip() for line in text.splitlines()]
