"""UDP links. Datagrams go straight from the caller's thread: a loopback peer has them when `send` returns."""

from __future__ import annotations

import socket
from typing import Any

from bridge.links.ledger import Ledger
from bridge.links.uri import Address
from bridge.wire import LinkState, Message, Sent
from tracker.errors import OperatorError

# One call reads at most this many datagrams, so that a flood cannot hold up the loop.
_DATAGRAMS_PER_CALL = 64
_DATAGRAM_BYTES = 65535


class _UdpLink:
    """What both directions share: a non-blocking socket, and books."""

    def __init__(self, address: Address, ledger: Ledger) -> None:
        self.name = address.uri
        self._ledger = ledger
        self._family, self._far = _resolve(address)
        self._socket = socket.socket(self._family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def sent(self) -> list[Sent]:
        """Return what has left since the last call."""
        return self._ledger.collect()

    def state(self) -> LinkState:
        """Return how the link fares."""
        return self._ledger.state()

    def close(self) -> None:
        """Close the socket; datagrams do not wait."""
        self._socket.close()


class UdpOutLink(_UdpLink):
    """Send to one host and port, and hear only that peer.

    The socket is connected, so that the kernel reports a peer that is not there (ECONNREFUSED). That report answers
    an earlier datagram and costs the present call its turn; so the call tries once more, and the first datagram
    after the peer is back does arrive.
    """

    def __init__(self, address: Address, ledger: Ledger) -> None:
        super().__init__(address, ledger)
        self._refused = False
        try:
            self._socket.connect(self._far)
        except OSError as error:
            self._socket.close()
            raise OperatorError(
                f"link {address.uri}: cannot send there ({error.strerror}); give the autopilot's own address"
            ) from error

    def send(self, message: Message) -> None:
        """Send the message now, or count it as dropped."""
        raw = self._ledger.frame(message)
        try:
            self._send_past_refusal(raw)
        except OSError as error:
            self._ledger.dropped()
            self._ledger.failed(error)
            return
        self._ledger.took(message, raw)
        if self._refused:
            self._ledger.down("connection refused: nobody listens there")
            self._refused = False
        else:
            self._ledger.up()

    def receive(self) -> bytes:
        """Return the bytes the peer sent since the last call."""
        datagrams = []
        for _ in range(_DATAGRAMS_PER_CALL):
            try:
                datagrams.append(self._socket.recv(_DATAGRAM_BYTES))
            except ConnectionRefusedError:
                self._count_refusal()
            except OSError:  # nothing there, or closed; a real fault shows at the next send
                break
        return b"".join(datagrams)

    def _send_past_refusal(self, raw: bytes) -> None:
        try:
            self._socket.send(raw)
        except ConnectionRefusedError:
            self._count_refusal()
            self._socket.send(raw)

    def _count_refusal(self) -> None:
        self._ledger.dropped()
        self._refused = True


class UdpInLink(_UdpLink):
    """Listen on a host and port, and answer whoever was heard last."""

    def __init__(self, address: Address, ledger: Ledger) -> None:
        super().__init__(address, ledger)
        self._peer: Any = None
        self._inbox = bytearray()
        try:
            self._socket.bind(self._far)
        except OSError as error:
            self._socket.close()
            raise OperatorError(
                f"link {address.uri}: cannot listen there ({error.strerror}); "
                "give one of this host's own addresses and a free port above 1023"
            ) from error
        self._ledger.down("nobody heard yet")

    def send(self, message: Message) -> None:
        """Send the message to the last peer heard, or count it as dropped."""
        self._listen()
        if self._peer is None:
            self._ledger.dropped()
            return
        raw = self._ledger.frame(message)
        try:
            self._socket.sendto(raw, self._peer)
        except OSError as error:
            self._ledger.dropped()
            self._ledger.failed(error)
            return
        self._ledger.took(message, raw)
        self._ledger.up()

    def receive(self) -> bytes:
        """Return the bytes peers sent since the last call."""
        self._listen()
        data = bytes(self._inbox)
        self._inbox.clear()
        return data

    def _listen(self) -> None:
        """Take in what came; beyond one call's worth unread, the oldest goes."""
        for _ in range(_DATAGRAMS_PER_CALL):
            try:
                data, self._peer = self._socket.recvfrom(_DATAGRAM_BYTES)
            except OSError:  # nothing there, or closed
                break
            self._inbox += data
        del self._inbox[:-_DATAGRAM_BYTES]


def _resolve(address: Address) -> tuple[int, Any]:
    """Return the address family and the socket address of a host and port."""
    try:
        found = socket.getaddrinfo(address.place, address.number, type=socket.SOCK_DGRAM)
    except (OSError, UnicodeError) as error:  # a name with an empty or overlong part is a UnicodeError
        raise OperatorError(
            f"link {address.uri}: host {address.place} does not resolve ({error}); check its name or give an IP address"
        ) from error
    return found[0][0], found[0][4]
