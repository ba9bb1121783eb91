"""The autopilot's texts as lines of the page: what each means, why it comes, what to do."""

from __future__ import annotations

import re
from collections.abc import Iterable

from bridge.preflight.hearing import Text
from bridge.preflight.plain_words import Weight, explain
from bridge.preflight.verdict import Line, Mark, Section

TITLE = "What it says"
ARMS = "nothing, in its present mode"
_AGAINST = re.compile(r"^(PreArm|Arm|Preflight Fail)\b", re.IGNORECASE)


def said(texts: Iterable[Text], asked: bool, answered: bool, ready: bool | None = None) -> Section:
    """Return the section.

    asked, answered: whether its own checks were run, and whether it took the order.
    ready: whether it says that it would arm, None where it does not tell.
    """
    distinct = list(dict.fromkeys(text.text for text in texts))
    lines = [line for line in map(_line, distinct) if line is not None]
    if asked and not any(_AGAINST.match(text) for text in distinct):
        lines.append(_unready() if ready is False else _quiet(answered))
    return Section(TITLE, tuple(lines), tuple(note for note in map(_note, distinct) if note))


def _line(text: str) -> Line | None:
    meaning = explain(text)
    if meaning is None:
        if not _AGAINST.match(text):
            return None
        return Line(Mark.WARN, f'"{text}"', "it will not arm; nothing to do with poses", "", "see its own manual")
    if meaning.weight is Weight.GOOD:
        return None
    mark = Mark.FAIL if meaning.weight is Weight.BLOCKS else Mark.WARN
    return Line(mark, f'"{text}"', meaning.meaning, "", f"cause: {meaning.cause}. Remedy: {meaning.remedy}")


def _unready() -> Line:
    """Speak for an autopilot that gives its reasons by other ways than STATUSTEXT: PX4 sends most as events."""
    fix = "its ground station names them (QGroundControl: the arming checks behind the flight mode)"
    return Line(Mark.WARN, "its own checks", "it will not arm, and says no reason here", ARMS, fix)


def _quiet(answered: bool) -> Line:
    if answered:
        return Line(Mark.PASS, "its own checks", "nothing against arming", ARMS)
    fix = "it does not run its checks when asked: look at what it says on the ground station before take-off"
    return Line(Mark.WARN, "its own checks", "not run", ARMS, fix)


def _note(text: str) -> str:
    meaning = explain(text)
    return f'"{text}": {meaning.meaning}' if meaning is not None and meaning.weight is Weight.GOOD else ""
