"""Steps on their way from the loop's thread to the log's."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterator

from bridge.log.entry import Entry

BATCH = 8  # steps: 64 hold poses up for 5 ms, and with 4 the many turns cost the loop more than the writing
PATIENCE_S = 0.25


class Backlog:
    """Hold at most `capacity` entries for one thread that puts and one that takes.

    The taking thread is woken for BATCH entries together, or after PATIENCE_S for what there is.
    """

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._batch = max(1, min(BATCH, capacity // 2))  # the loop goes on filling it meanwhile
        self._waiting: deque[Entry] = deque()
        self._wake = threading.Event()
        self._room = threading.Event()  # not set once somebody looks for it, until there is some
        self._room.set()
        self._closed = False

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, entry: Entry) -> bool:
        """Add an entry and say so, unless there is no room."""
        count = len(self._waiting) + 1
        if count > self._capacity:
            self._wake.set()
            return False
        self._waiting.append(entry)
        if count >= self._batch:
            self._wake.set()
        return True

    def wait_for_room(self, timeout_s: float) -> None:
        """Wait until half the room is free."""
        self._room.clear()
        if len(self._waiting) >= self._capacity:
            self._wake.set()
            self._room.wait(timeout_s)

    def close(self) -> None:
        """End `entries` once everything is taken."""
        self._closed = True
        self._wake.set()

    def entries(self) -> Iterator[Entry | None]:
        """Yield each entry as it is to be written, and None whenever none came for PATIENCE_S."""
        while True:
            woken = self._wake.wait(PATIENCE_S)
            self._wake.clear()
            if not woken and not self._waiting:
                yield None
            closed = self._closed  # before the last look: what was put before the closing is taken
            while self._waiting:
                entry = self._waiting.popleft()
                if not self._room.is_set() and len(self._waiting) <= self._capacity // 2:
                    self._room.set()
                yield entry
            if closed:
                return
