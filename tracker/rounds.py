"""Frames that belong together: one round of the cameras."""

from __future__ import annotations

from collections import deque

from tracker.types import Frame, Silence

MEMORY = 3  # rounds by which a camera's companions are known
NOBODY: frozenset[int] = frozenset()


class Rounds:
    """Gather frames of one instant, and wait no longer than experience says it is worth.

    Triggered cameras see one instant: a round closes as soon as all companions of its frames have come. Companions
    are the cameras that shared one of a camera's last rounds, so a free-running camera is a round of its own at once,
    and a camera that went blind is waited for only MEMORY times. A frame of another instant, or silence, closes a
    round as it stands.

    camera_count: cameras in the rig.  window_ns: frames this close are of one instant [ns].
    """

    def __init__(self, camera_count: int, window_ns: int) -> None:
        self._window_ns = window_ns
        everyone = frozenset(range(camera_count))
        self._shared = [deque([everyone], maxlen=MEMORY) for _ in range(camera_count)]
        self._companions = [everyone for _ in range(camera_count)]  # of `_shared`, all together
        self._open: dict[int, Frame] = {}
        self._opened_ns = self._newest_ns = 0  # the first stamp in it, and the last
        self._closed_ns = -(2**63)
        self._closed: frozenset[int] = frozenset()

    def take(self, event: Frame | Silence) -> list[tuple[Frame, ...]]:
        """Add an event and return the rounds that it closes, frames in the order of their cameras."""
        closed = []
        if isinstance(event, Silence):
            return [self._close()] if self._open else []
        if self._open and (event.camera in self._open or not self._one_instant(event)):
            closed.append(self._close())
        if self._open:
            self._opened_ns, self._newest_ns = min(self._opened_ns, event.t_ns), max(self._newest_ns, event.t_ns)
        else:
            self._opened_ns = self._newest_ns = event.t_ns
        self._open[event.camera] = event
        if self._expected() <= self._open.keys():
            closed.append(self._close())
        return closed

    def rest(self) -> list[tuple[Frame, ...]]:
        """Return the round that was still open when the events ended."""
        return [self._close()] if self._open else []

    def _one_instant(self, frame: Frame) -> bool:
        return self._newest_ns - self._window_ns <= frame.t_ns <= self._opened_ns + self._window_ns

    def _stragglers_of(self) -> frozenset[int]:
        """Return the cameras of the last closed round, if the open one is of the same instant."""
        return self._closed if abs(self._opened_ns - self._closed_ns) <= self._window_ns else NOBODY

    def _expected(self) -> frozenset[int]:
        """Return the cameras that the open round waits for."""
        return NOBODY.union(*[self._companions[camera] for camera in self._open]) - self._stragglers_of()

    def _close(self) -> tuple[Frame, ...]:
        """Close the open round and remember who came together."""
        together = self._stragglers_of().union(self._open)
        frames = tuple([self._open[camera] for camera in sorted(self._open)])
        for camera in together:
            self._shared[camera].append(together)
            if self._companions[camera] != together:
                self._companions[camera] = NOBODY.union(*self._shared[camera])
        self._closed, self._closed_ns = together, self._newest_ns
        self._open = {}
        return frames
