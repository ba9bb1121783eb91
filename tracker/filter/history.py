"""The last few updates of a track, so that a late frame can be put in where it belongs."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from dataclasses import dataclass, replace

from tracker.filter.ekf import Update
from tracker.filter.noise import doubted
from tracker.state import State
from tracker.types import BallSighting

KEPT = 8  # updates, and those that poses wait for


@dataclass(frozen=True, slots=True, eq=False)
class Later:
    """An update taken back: when it was and the sightings that made it."""

    t_ns: int
    sightings: tuple[BallSighting, ...]


class History:
    """States after the newest updates, in order of time, with what made them.

    lag_rounds: by how many of them poses go out late.
    """

    def __init__(self, lag_rounds: int = 0) -> None:
        self._updates: deque[Update] = deque(maxlen=KEPT + lag_rounds)

    @property
    def newest(self) -> State | None:
        """Return the newest state, None before the first."""
        return self._updates[-1].state if self._updates else None

    def forgot(self, t_ns: int) -> bool:
        """Say whether an instant lies before all that is kept."""
        return bool(self._updates) and t_ns < self._updates[0].state.t_ns

    def remember(self, update: Update) -> None:
        """Add the newest update."""
        self._updates.append(update)

    def restart(self, update: Update) -> None:
        """Forget all and begin with an update."""
        self._updates.clear()
        self._updates.append(update)

    def doubt(self, camera: int, sigma_px: float) -> None:
        """Begin anew with the newest update, one camera's noise unknown but for a sigma [px]."""
        if self._updates:
            newest = self._updates[-1]
            noise = doubted(newest.state.noise, camera, sigma_px)
            self.restart(newest._replace(state=replace(newest.state, noise=noise)))

    def since(self, t_ns: int) -> list[Update]:
        """Return the last update of an instant and those after it; none when it was taken back or is forgotten."""
        if self._updates and _instant(self._updates[-1]) == t_ns:  # as it is where poses do not wait
            return [self._updates[-1]]
        updates = list(self._updates)
        first = bisect_right(updates, t_ns, key=_instant) - 1
        return updates[first:] if first >= 0 and _instant(updates[first]) == t_ns else []

    def back_to(self, t_ns: int) -> list[Later]:
        """Take back the updates after an instant that is not forgotten; return them in order of time."""
        later: list[Later] = []
        while self._updates and self._updates[-1].state.t_ns > t_ns:
            update = self._updates.pop()
            later.insert(0, Later(update.state.t_ns, update.used))
        return later


def _instant(update: Update) -> int:
    return update.state.t_ns
