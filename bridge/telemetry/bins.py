"""The last two minutes, a second at a time, in bounded memory."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

SECOND_NS = 1_000_000_000
KEPT = 120


@dataclass(slots=True, eq=False)
class Bin:
    """One second of stream time.

    second: which, since the clock's zero.  poses: estimates in it.  gap_ns: the longest that ended in it [ns].
    age_ns: of the oldest estimate when it came [ns].  latency_ns: the longest [ns].  nis, dof: sums over its estimates.
    frames: by camera.  seen: sightings used, by camera and ball.
    """

    second: int
    frames: list[int]
    seen: list[list[int]]
    poses: int = 0
    gap_ns: int = 0
    age_ns: int = 0
    latency_ns: int = 0
    nis: float = 0.0
    dof: int = 0


@dataclass(slots=True, eq=False)
class Bins:
    """The newest seconds, the current one last."""

    cameras: int
    balls: int
    _kept: deque[Bin] = field(default_factory=lambda: deque(maxlen=KEPT))

    def at(self, t_ns: int) -> Bin:
        """Return the bin of a stream time; one before the newest counts there."""
        second = t_ns // SECOND_NS
        if not self._kept or second > self._kept[-1].second:
            self._move_on(second)
        return self._kept[-1]

    def last(self, count: int) -> list[Bin]:
        """Return the newest bins, at most `count`, oldest first."""
        return list(self._kept)[-count:]

    def _move_on(self, second: int) -> None:
        """Begin a second, and the empty ones before it that nothing happened in."""
        first = second if not self._kept else max(self._kept[-1].second + 1, second - KEPT + 1)
        for each in range(first, second + 1):
            seen = [[0] * self.balls for _ in range(self.cameras)]
            self._kept.append(Bin(each, [0] * self.cameras, seen))
