"""Ways out of this computer: the only place that opens sockets and serial ports."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Protocol

from bridge.clock import Nanoseconds
from bridge.links.ledger import Encode, Ledger
from bridge.links.memory import Deliver, MemoryLink
from bridge.links.serial import open_serial
from bridge.links.tcp import open_tcp
from bridge.links.udp import UdpInLink, UdpOutLink
from bridge.links.uri import FORMS, Address, line_bytes_s, on_paper, parse
from bridge.wire import LinkState, Message, Sent

__all__ = ["FORMS", "Deliver", "Encode", "Link", "MemoryLink", "line_bytes_s", "on_paper", "open_link", "parse"]


class Link(Protocol):
    """One way to an autopilot. No method but `close` ever waits, and none raises for what the far end does."""

    @property
    def name(self) -> str:
        """The URI as given."""

    def send(self, message: Message) -> None:
        """Send the message, or count it as dropped; a link with a thread may let a newer one replace it."""

    def sent(self) -> list[Sent]:
        """Return what has left since the last call."""

    def receive(self) -> bytes:
        """Return the bytes that came in since the last call."""

    def listen(self, heard: Callable[[bytes], None]) -> None:
        """Give what comes in from now on to `heard` instead of `receive`, as it comes, from a thread of the link's.

        `heard` may call `send`, which any thread may.
        """

    def replaced(self) -> int:
        """Return how many messages a newer one has replaced so far."""

    def state(self) -> LinkState:
        """Return how the link fares."""

    def close(self) -> None:
        """Give what still waits a short time to leave, then let go of the port. Twice is once."""


_OPENERS: Mapping[str, Callable[[Address, Ledger], Link]] = MappingProxyType(
    {
        "udpout": UdpOutLink,
        "udpin": UdpInLink,
        "serial": open_serial,
        "tcp": open_tcp,
        "memory": MemoryLink,
    }
)


def open_link(uri: str, encode: Encode, stopwatch: Nanoseconds) -> Link:
    """Open the link a URI names.

    Args:
        uri: as in `FORMS`.
        encode: frames a message with a sequence number; the link calls it when the message really goes.
        stopwatch: reads a running time [ns].
    Raises:
        OperatorError: a URI of no known form, a host or device that is not there, a port in use or forbidden.
    """
    address = parse(uri)
    return _OPENERS[address.scheme](address, Ledger(uri, encode, stopwatch))
