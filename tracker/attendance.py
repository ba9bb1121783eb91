"""Which camera saw which ball when: whether too little of the marker is seen, and whether a camera has just lost it."""

from __future__ import annotations

from collections.abc import Iterable

from tracker.filter.ekf import POSED
from tracker.types import BallSighting

POSED_NS = 100_000_000  # longer than this fewer sightings than make a pose carry no track: they fit a mistake as well


class Attendance:
    """Keeps count of the sightings that updates believed.

    hardly_any: for a while fewer than make a pose: what seems another is soon a mistake.
    fell_silent: a camera that looked saw none, and had seen some the time before. The marker may be elsewhere then, and
        what the others see of it something else.
    """

    def __init__(self) -> None:
        self._seen_ns: dict[tuple[int, int], int] = {}  # by camera and ball
        self._seeing: set[int] = set()  # cameras, when they looked last
        self.hardly_any = False
        self.fell_silent = False

    def take(self, used: Iterable[BallSighting], looking: Iterable[int]) -> None:
        """Take note of what an update used, at least one sighting, and of the cameras that gave it frames."""
        seen_ns, seeing = self._seen_ns, set()
        for sighting in used:
            of, t_ns = sighting[:2], sighting.t_ns
            seeing.add(of[0])
            if seen_ns.get(of, t_ns) <= t_ns:
                seen_ns[of] = t_ns
        newest_ns = max(seen_ns.values())
        lately = [ball for (_, ball), t_ns in seen_ns.items() if newest_ns - t_ns <= POSED_NS]
        self.hardly_any = len(lately) < POSED or len(set(lately)) < 2
        silent = set(looking) - seeing
        self.fell_silent = not silent.isdisjoint(self._seeing)
        self._seeing = (self._seeing - silent) | seeing
