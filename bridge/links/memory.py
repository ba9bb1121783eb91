"""A link that ends in this process: for benches and tests."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from bridge.links.ledger import Ledger
from bridge.links.uri import Address
from bridge.wire import LinkState, Message, Sent

_KEPT_FRAMES = 65536
Deliver = Callable[[bytes], None]
"""Lets bytes come in."""


class MemoryLink:
    """Keep the newest frames in `frames`, and receive whatever `deliver` is given."""

    def __init__(self, address: Address, ledger: Ledger) -> None:
        self.name = address.uri
        self.frames: deque[bytes] = deque(maxlen=_KEPT_FRAMES)
        self._inbox = bytearray()
        self._heard: Callable[[bytes], None] | None = None
        self._ledger = ledger
        self._open = True

    def send(self, message: Message) -> None:
        """Keep the message's frame."""
        if not self._open:
            self._ledger.dropped()
            self._ledger.down("closed")
            return
        raw = self._ledger.frame(message)
        self.frames.append(raw)
        self._ledger.took(message, raw)

    def deliver(self, data: bytes) -> None:
        """Let bytes come in."""
        self._inbox += data
        if self._heard is not None:
            self._heard(self.receive())

    def listen(self, heard: Callable[[bytes], None]) -> None:
        """Give what is delivered from now on to `heard` at once."""
        self._heard = heard

    def sent(self) -> list[Sent]:
        """Return what has left since the last call."""
        return self._ledger.collect()

    def receive(self) -> bytes:
        """Return the bytes delivered since the last call."""
        data = bytes(self._inbox)
        self._inbox.clear()
        return data

    def replaced(self) -> int:
        """Return how many messages a newer one has replaced so far."""
        return self._ledger.replaced()

    def state(self) -> LinkState:
        """Return how the link fares."""
        return self._ledger.state()

    def close(self) -> None:
        """Take no more frames; those kept stay."""
        self._open = False
