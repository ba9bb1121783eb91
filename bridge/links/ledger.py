"""What one link has sent and lost, and whether it is up."""

from __future__ import annotations

import threading
from collections.abc import Callable

from bridge.clock import Nanoseconds
from bridge.wire import LinkState, Message, Sent

Encode = Callable[[Message, int], bytes]
"""Frames a message with the sequence number, 0..255."""


class Ledger:
    """The books of one link: written by whichever thread sends, read by the loop.

    name: the link's URI.  encode: frames a message.  stopwatch: reads a running time [ns].
    """

    def __init__(self, name: str, encode: Encode, stopwatch: Nanoseconds) -> None:
        self.name = name
        self._encode = encode
        self._stopwatch = stopwatch
        self._sequence = 0
        self._lock = threading.Lock()
        self._records: list[Sent] = []
        self._reason = ""
        self._sent = self._dropped = self._superseded = 0

    def now_ns(self) -> int:
        """Return the stopwatch's reading [ns]."""
        return self._stopwatch()

    def frame(self, message: Message) -> bytes:
        """Return the frame to write now; its sequence number is used up only once `took` is called."""
        return self._encode(message, self._sequence)

    def took(self, message: Message, raw: bytes) -> None:
        """Enter a frame that the kernel took whole."""
        name, t_ns, available_ns, fields, _ = message
        record = Sent(self.name, name, t_ns, self._stopwatch(), available_ns, raw, fields)
        self._sequence = (self._sequence + 1) % 256
        with self._lock:
            self._records.append(record)
            self._sent += 1

    def dropped(self, count: int = 1) -> None:
        """Enter messages that could not go."""
        with self._lock:
            self._dropped += count

    def superseded(self) -> None:
        """Enter a message that a newer one of its name replaced."""
        with self._lock:
            self._superseded += 1

    def up(self) -> None:
        """Enter that the link works."""
        self._reason = ""

    def down(self, reason: str) -> None:
        """Enter that the link does not work, and why."""
        self._reason = reason

    def failed(self, error: OSError) -> None:
        """Enter that the link does not work because of this error."""
        self._reason = error.strerror or str(error)

    def collect(self) -> list[Sent]:
        """Return the frames taken since the last call, in the order they went."""
        with self._lock:
            records, self._records = self._records, []
        return records

    def replaced(self) -> int:
        """Return how many messages a newer one has replaced so far."""
        return self._superseded

    def state(self) -> LinkState:
        """Return the books as they stand."""
        with self._lock:
            reason = self._reason
            return LinkState(self.name, not reason, reason, self._sent, self._dropped, self._superseded)
