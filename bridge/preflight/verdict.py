"""A line of the verdict, and what --apply would write."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Mark(StrEnum):
    """How a line came out."""

    PASS = "pass"
    WARN = "warn"
    FAIL = "fail"


@dataclass(frozen=True, slots=True)
class Write:
    """A parameter to set. reboot: it counts only after the autopilot has been started anew."""

    name: str
    value: float
    reboot: bool


@dataclass(frozen=True, slots=True)
class Line:
    """One line of the page.

    what: what was looked at.  found, needed: with units.  fix: what exactly to do, empty where nothing is.
    write: what --apply would set.
    """

    mark: Mark
    what: str
    found: str
    needed: str
    fix: str = ""
    write: Write | None = None


def good(lines: tuple[Line, ...]) -> bool:
    """Say whether the vehicle may fly: no line failed."""
    return all(line.mark is not Mark.FAIL for line in lines)


def writes(lines: tuple[Line, ...]) -> tuple[Write, ...]:
    """Return what --apply would set, each parameter once."""
    return tuple({line.write.name: line.write for line in lines if line.write is not None}.values())
