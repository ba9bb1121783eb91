"""What comes in on a link, heard in the link's own thread: stamped, cut into messages, and time requests answered."""

from __future__ import annotations

from collections import deque

from bridge.clock import Nanoseconds
from bridge.dialect import Reader
from bridge.dialogue.timesync import answer
from bridge.links import Link
from bridge.signing import Signing
from bridge.wire import Received

_KEPT_MESSAGES = 4096


class Ear:
    """Listen on a link.

    A TIMESYNC request is answered here and at once: the loop comes by only once a frame, and an answer 30 ms late is
    refused. All else waits for the loop; when it does not come, the oldest goes.

    Args:
        link: to listen on and answer by.  now: stream time [ns], read from the link's thread.
        signing: what is not rightly signed is not heard; None to hear everything.
    """

    def __init__(self, link: Link, now: Nanoseconds, signing: Signing | None = None) -> None:
        self._link = link
        self._now = now
        self._reader = Reader(signing)
        self._heard: deque[Received] = deque(maxlen=_KEPT_MESSAGES)
        link.listen(self._hear)

    def take(self) -> list[Received]:
        """Return the messages that came in since the last call."""
        return [self._heard.popleft() for _ in range(len(self._heard))] if self._heard else []

    def _hear(self, data: bytes) -> None:
        for message in self._reader.feed(data, self._now()):
            reply = answer(message)
            if reply is not None:
                self._link.send(reply)
            self._heard.append(message)
