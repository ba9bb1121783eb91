"""Where camera threads leave frames and one reader takes them: the newest of each camera, never an old one."""

from __future__ import annotations

import threading
from collections import deque

from tracker.types import Frame, Rejected


class Mailbox:
    """Hold at most one frame a camera; a newer one takes the place of one not yet taken."""

    def __init__(self, cameras: int) -> None:
        self._changed = threading.Condition()
        self._frames: dict[int, Frame] = {}  # in order of arrival
        self._troubles: deque[Rejected] = deque()
        self._dropped = [0] * cameras
        self._open = True

    def put(self, event: Frame | Rejected) -> None:
        """Leave a frame or word of trouble."""
        with self._changed:
            if isinstance(event, Rejected):
                self._troubles.append(event)
            else:
                if self._frames.pop(event.camera, None) is not None:
                    self._dropped[event.camera] += 1
                self._frames[event.camera] = event
            self._changed.notify()

    def take(self, timeout_s: float) -> Frame | Rejected | None:
        """Take what came first, trouble before frames; None if nothing came in time or the box was closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._frames or self._troubles or not self._open, timeout_s)
            if not self._open:
                return None
            if self._troubles:
                return self._troubles.popleft()
            if self._frames:
                return self._frames.pop(next(iter(self._frames)))
            return None

    def close(self) -> None:
        """Wake the reader; it gets nothing more."""
        with self._changed:
            self._open = False
            self._changed.notify_all()

    @property
    def dropped(self) -> tuple[int, ...]:
        """Return how many frames of each camera a newer one replaced before they were taken."""
        with self._changed:
            return tuple(self._dropped)
