"""What a rule is, and how a figure is judged."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum, StrEnum

from bridge.alarms.readings import Readings


class Level(StrEnum):
    """How much it matters. ALARM: do not fly, or land.  WARNING: look into it."""

    ALARM = "alarm"
    WARNING = "warning"


class Verdict(Enum):
    """What a reading says of a rule. BETWEEN is neither bad enough to raise the alarm nor good enough to end it."""

    BAD = "bad"
    BETWEEN = "between"
    GOOD = "good"


@dataclass(frozen=True, slots=True)
class Finding:
    """A verdict on one subject (a camera, a link, "" for the run), with its words for an alarm."""

    subject: str
    verdict: Verdict
    cause: str
    remedy: str


@dataclass(frozen=True, slots=True)
class Rule:
    """One alarm.

    raise_s, clear_s: how long a verdict must last to raise it, and to end it [s].
    judge: finds what is not well; of a subject that is, it says nothing, since words for nobody cost a flight time.
    """

    name: str
    level: Level
    raise_s: float
    clear_s: float
    judge: Callable[[Readings], Iterable[Finding]]


def above(value: float | None, bad: float, good: float) -> Verdict:
    """Judge a value that should be small: bad above one limit, good again below another."""
    if value is None or value <= good:
        return Verdict.GOOD
    return Verdict.BAD if value > bad else Verdict.BETWEEN


def below(value: float | None, bad: float, good: float) -> Verdict:
    """Judge a value that should be large."""
    return above(None if value is None else -value, -bad, -good)
