"""UDP links. Datagrams go straight from the caller's thread: a loopback peer has them when `send` returns."""

from __future__ import annotations

import socket
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

from bridge.links.ledger import Ledger
from bridge.links.listener import Listener
from bridge.links.uri import Address
from bridge.wire import LinkState, Message, Sent
from tracker.errors import OperatorError

# One call reads at most this many datagrams, so that a flood cannot hold up the loop.
_DATAGRAMS_PER_CALL = 64
_DATAGRAM_BYTES = 65535
_PEER_SILENT_NS = 2_000_000_000  # after this, another host that calls is the autopilot, restarted


class _UdpLink(ABC):
    """What both directions share: a non-blocking socket, books, and a lock for the loop and a listening thread."""

    def __init__(self, address: Address, ledger: Ledger) -> None:
        self.name = address.uri
        self._ledger = ledger
        self._family, self._far = _resolve(address)
        self._socket = socket.socket(self._family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._lock = threading.RLock()
        self._listener: Listener | None = None

    def send(self, message: Message) -> None:
        """Send the message now, or count it as dropped."""
        with self._lock:
            self._send(message)

    @abstractmethod
    def receive(self) -> bytes:
        """Return the bytes that came in since the last call."""

    def listen(self, heard: Callable[[bytes], None]) -> None:
        """Give what comes in from now on to `heard`, from a thread of its own, as it comes."""
        self._listener = Listener(self._socket.fileno(), lambda: heard(self.receive()), self.name)

    def sent(self) -> list[Sent]:
        """Return what has left since the last call."""
        return self._ledger.collect()

    def replaced(self) -> int:
        """Return how many messages a newer one has replaced so far."""
        return self._ledger.replaced()

    def state(self) -> LinkState:
        """Return how the link fares."""
        return self._ledger.state()

    def close(self) -> None:
        """Close the socket; datagrams do not wait."""
        if self._listener is not None:
            self._listener.close()
            self._listener = None
        self._socket.close()

    @abstractmethod
    def _send(self, message: Message) -> None: ...


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

    def _send(self, message: Message) -> None:
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
        with self._lock:
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
    """Listen on a host and port, and answer whoever called first.

    Another caller is not listened to, unless the first has been silent for two seconds: it may have been restarted.
    """

    def __init__(self, address: Address, ledger: Ledger) -> None:
        super().__init__(address, ledger)
        self._peer: Any = None
        self._peer_heard_ns = 0
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

    def _send(self, message: Message) -> None:
        if self._listener is None:
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
        """Return the bytes the peer sent since the last call."""
        with self._lock:
            self._listen()
            data = bytes(self._inbox)
            self._inbox.clear()
        return data

    def _listen(self) -> None:
        """Take in what came; beyond one call's worth unread, the oldest goes."""
        for _ in range(_DATAGRAMS_PER_CALL):
            try:
                data, caller = self._socket.recvfrom(_DATAGRAM_BYTES)
            except OSError:  # nothing there, or closed
                break
            if self._is_peer(caller):
                self._inbox += data
        del self._inbox[:-_DATAGRAM_BYTES]

    def _is_peer(self, caller: object) -> bool:
        """Say whether a caller is the one that is listened to, taking a new one when the old is silent."""
        now_ns = self._ledger.now_ns()
        if caller != self._peer and self._peer is not None and now_ns - self._peer_heard_ns < _PEER_SILENT_NS:
            return False
        self._peer, self._peer_heard_ns = caller, now_ns
        return True


def _resolve(address: Address) -> tuple[int, Any]:
    """Return the address family and the socket address of a host and port."""
    try:
        found = socket.getaddrinfo(address.place, address.number, type=socket.SOCK_DGRAM)
    except (OSError, UnicodeError) as error:  # a name with an empty or overlong part is a UnicodeError
        raise OperatorError(
            f"link {address.uri}: host {address.place} does not resolve ({error}); check its name or give an IP address"
        ) from error
    return found[0][0], found[0][4]
