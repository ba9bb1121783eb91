"""What waits for a slow link: the newest message of each name and slot."""

from __future__ import annotations

import threading
from enum import Enum, auto

from bridge.wire import Message


class Posted(Enum):
    """What became of a message put into the mailbox."""

    NEW = auto()
    REPLACED_OLDER = auto()
    REFUSED = auto()


class Mailbox:
    """Hold at most one message of each name and slot; a newer one takes the older one's place in the queue.

    It refuses messages while shut, so that nothing stale waits there when a lost port comes back.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._waiting: dict[tuple[str, str], Message] = {}
        self._is_open = True

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, message: Message) -> Posted:
        """Leave a message."""
        with self._lock:
            if not self._is_open:
                return Posted.REFUSED
            place = message.name, message.slot
            posted = Posted.REPLACED_OLDER if place in self._waiting else Posted.NEW
            self._waiting[place] = message
            return posted

    def take(self) -> Message | None:
        """Return the message that has waited longest, None if there is none."""
        with self._lock:
            place = next(iter(self._waiting), None)
            return None if place is None else self._waiting.pop(place)

    def open(self) -> None:
        """Take messages again."""
        with self._lock:
            self._is_open = True

    def shut(self) -> int:
        """Throw away what waits, take nothing more, and return how many were thrown away."""
        with self._lock:
            thrown = len(self._waiting)
            self._waiting.clear()
            self._is_open = False
            return thrown
