"""What the pilot is told over the link itself: changes of state as STATUSTEXT, each once."""

from __future__ import annotations

from enum import IntEnum

from bridge.dialect import make_message
from bridge.wire import Message

TEXT_BYTES = 50
AGAIN_NS = 1_000_000_000


class Severity(IntEnum):
    """MAV_SEVERITY, as far as it is used."""

    CRITICAL = 2
    WARNING = 4
    NOTICE = 5


class Announcer:
    """Say what a matter has come to whenever it changes, and no matter oftener than once a second."""

    def __init__(self) -> None:
        self._said: dict[str, tuple[str, int]] = {}

    def say(self, matter: str, text: str, severity: Severity, now_ns: int) -> Message | None:
        """Return the STATUSTEXT if the text is news; an empty text says nothing and is remembered all the same."""
        last, at_ns = self._said.get(matter, ("", now_ns - AGAIN_NS))
        if text == last or now_ns - at_ns < AGAIN_NS:
            return None
        self._said[matter] = text, now_ns
        if not text:
            return None
        return make_message("STATUSTEXT", now_ns, matter, severity=int(severity), text=f"posebridge: {text}")
