"""What the pilot must hear of: every change of state that matters in flight, put into words of 50 bytes at most."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from bridge.dialogue.announce import Announcer, Severity
from bridge.dialogue.origin import OriginState
from bridge.wire import Message
from tracker.types import TrackState

CALM_NS = 2_000_000_000
BURST_NS = 500_000_000
ORIGIN_TROUBLE = (OriginState.LOST, OriginState.MISSING, OriginState.REFUSED, OriginState.UNCONFIRMED)


@dataclass(frozen=True, slots=True)
class Facts:
    """How things stand.

    late: the newest estimate was too old to send.  away: the autopilot has fallen silent.
    saturated: the link does not take all that it is given.  restarts: how often the autopilot's clock has jumped.
    stranger: system id of a second autopilot, None for none.
    yaw, calibration: what the watches over them have to say in a few words, "" for nothing.
    """

    track: TrackState
    late: bool
    away: bool
    saturated: bool
    restarts: int
    stranger: int | None
    origin: OriginState
    yaw: str = ""
    calibration: str = ""


class Saturation:
    """Whether newer messages take the place of those that wait: for half a second on, until two seconds without."""

    def __init__(self) -> None:
        self._count: int | None = None
        self._since_ns: int | None = None
        self._grew_ns = 0
        self.now = False

    def take(self, superseded: int, now_ns: int) -> None:
        """Take the link's count of superseded messages at stream time now_ns [ns]; what was lost before is past."""
        if self._count is not None and superseded > self._count:
            self._since_ns = now_ns if self._since_ns is None else self._since_ns
            self._grew_ns = now_ns
        elif now_ns - self._grew_ns > CALM_NS:
            self._since_ns, self.now = None, False
        self._count = superseded
        self.now = self.now or (self._since_ns is not None and self._grew_ns - self._since_ns >= BURST_NS)


class News:
    """Tell each change once. What was never wrong is never said to be well again."""

    def __init__(self) -> None:
        self._announcer = Announcer()
        self._went_wrong: set[str] = set()

    def due(self, facts: Facts, now_ns: int) -> list[Message]:
        """Return the STATUSTEXTs that are due at stream time now_ns [ns]."""
        said = (self._announcer.say(matter, text, severity, now_ns) for matter, text, severity in self._words(facts))
        return [message for message in said if message is not None]

    def _words(self, facts: Facts) -> Iterator[tuple[str, str, Severity]]:
        """Yield each matter with what it has come to, "" for nothing to say."""
        lost = facts.track is TrackState.LOST
        yield "track", f"track {facts.track.value}", Severity.CRITICAL if lost else Severity.NOTICE
        yield self._ill_or_well("age", facts.late, "poses too old, none sent", "poses in time again", Severity.CRITICAL)
        yield self._ill_or_well("away", facts.away, "autopilot silent", "autopilot heard again", Severity.WARNING)
        yield self._ill_or_well("link", facts.saturated, "link full, rate reduced", "link free again", Severity.WARNING)
        jumped = f"autopilot clock stepped ({facts.restarts})" if facts.restarts else ""
        yield "clock", jumped, Severity.WARNING
        yield "yaw", facts.yaw, Severity.CRITICAL
        yield "calibration", facts.calibration, Severity.CRITICAL
        stranger = "" if facts.stranger is None else f"autopilot {facts.stranger} ignored"
        yield "stranger", stranger, Severity.WARNING
        origin = f"origin {facts.origin.name.lower()}" if facts.origin in ORIGIN_TROUBLE else ""
        yield "origin", origin, Severity.WARNING

    def _ill_or_well(
        self, matter: str, ill: bool, bad: str, good: str, severity: Severity
    ) -> tuple[str, str, Severity]:
        if ill:
            self._went_wrong.add(matter)
            return matter, bad, severity
        return matter, good if matter in self._went_wrong else "", Severity.NOTICE
