"""A line of the verdict, the sections of its page, and what --apply would write."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class Mark(StrEnum):
    """How a line came out."""

    PASS = "pass"
    WARN = "warn"  # it flies, and could do better
    FAIL = "fail"
    UNKNOWN = "unknown"  # it could not be seen, and nothing counts as good unseen


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


@dataclass(frozen=True, slots=True)
class Section:
    """Lines that belong together, and notes beside them that judge nothing."""

    title: str
    lines: tuple[Line, ...]
    notes: tuple[str, ...] = ()


def good(lines: Iterable[Line]) -> bool:
    """Say whether the vehicle may fly: nothing failed, nothing stayed unseen."""
    return all(line.mark in (Mark.PASS, Mark.WARN) for line in lines)


def writes(lines: Iterable[Line]) -> tuple[Write, ...]:
    """Return what --apply would set, each parameter once."""
    return tuple({line.write.name: line.write for line in lines if line.write is not None}.values())
