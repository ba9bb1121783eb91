"""What the rest of the bridge tells telemetry about itself."""

from __future__ import annotations

from dataclasses import dataclass

from bridge.dialogue import DialogueState
from bridge.wire import LinkState


@dataclass(frozen=True, slots=True)
class LogState:
    """The log: its file, size [bytes], steps written and dropped, and what ended it early, if anything did."""

    path: str
    size_bytes: int
    written: int
    dropped: int
    error: str = ""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """All that telemetry does not see in the loop's turns, as it stands now.

    log: None when nothing is recorded.  far_ends: in the links' order; empty where not known, as in a log.
    """

    links: tuple[LinkState, ...] = ()
    log: LogState | None = None
    far_ends: tuple[DialogueState, ...] = ()
