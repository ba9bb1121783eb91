"""Both ends of the loopback: the bridge that answers, and the monitor that calls.

A monitor says hello once a second; whoever was heard in the last three seconds is sent every snapshot. Both sockets
are bound to this computer's own 127.0.0.1, and the bridge's never waits: what does not go at once is dropped.
"""

from __future__ import annotations

import selectors
import socket
from collections.abc import Iterable

from bridge.clock import Nanoseconds

HOST = "127.0.0.1"
FIRST_PORT = 14730
PORTS = 8  # so many bridges on one computer can be watched
HELLO = b"posebridge monitor 1"
FORGET_NS = 3_000_000_000
LISTENERS = 4
DATAGRAMS_PER_CHECK = 16
_DATAGRAM_BYTES = 65_535


class Post:
    """The bridge's end. listeners: addresses heard lately, each with when [ns].

    sock: a bound datagram socket, which it then owns.
    """

    def __init__(self, sock: socket.socket) -> None:
        sock.setblocking(False)
        self._socket = sock
        self._listeners: dict[tuple[str, int], int] = {}
        self.port: int = sock.getsockname()[1]
        self.dropped = 0

    def anybody(self, now_ns: int) -> bool:
        """Take in hellos, at most a few, and say whether somebody listens; now_ns: stopwatch reading [ns]."""
        for _ in range(DATAGRAMS_PER_CHECK):
            try:
                data, peer = self._socket.recvfrom(len(HELLO) + 1)
            except OSError:  # nothing there, or closed
                break
            if data == HELLO and (peer in self._listeners or len(self._listeners) < LISTENERS):
                self._listeners[peer] = now_ns
        if self._listeners:
            self._listeners = {peer: at_ns for peer, at_ns in self._listeners.items() if now_ns - at_ns <= FORGET_NS}
        return bool(self._listeners)

    def send(self, data: bytes) -> None:
        """Give a snapshot to everybody who listens; one that does not go at once is dropped."""
        for peer in self._listeners:
            try:
                self._socket.sendto(data, peer)
            except OSError:
                self.dropped += 1

    def close(self) -> None:
        """Let go of the port. Twice is once."""
        self._socket.close()


def open_post(first_port: int) -> Post | None:
    """Take the first free port of `PORTS` from one on; None when all are taken."""
    for port in range(first_port, min(first_port + PORTS, 65_536)):
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            sock.bind((HOST, port))
        except OSError:
            sock.close()
            continue
        return Post(sock)
    return None


class Caller:
    """The monitor's end.

    ports: where bridges may answer.  stopwatch: reads a running time [ns].
    """

    def __init__(self, ports: Iterable[int], stopwatch: Nanoseconds) -> None:
        self._ports = tuple(ports)
        self._stopwatch = stopwatch
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((HOST, 0))
        self._socket.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._socket, selectors.EVENT_READ)
        self._hello_due_ns: int | None = None

    def listen(self, timeout_s: float) -> list[tuple[int, bytes]]:
        """Say hello if it is time, wait for an answer, and return the newest of each port that answered."""
        now_ns = self._stopwatch()
        if self._hello_due_ns is None or now_ns >= self._hello_due_ns:
            self._hello_due_ns = now_ns + 1_000_000_000
            self._hello()
        newest: dict[int, bytes] = {}
        if self._selector.select(timeout_s):
            for _ in range(DATAGRAMS_PER_CHECK):
                try:
                    data, (host, port) = self._socket.recvfrom(_DATAGRAM_BYTES)
                except OSError:
                    break
                if host == HOST and port in self._ports:
                    newest[port] = data
        return list(newest.items())

    def close(self) -> None:
        """Let go of the socket. Twice is once."""
        self._selector.close()
        self._socket.close()

    def _hello(self) -> None:
        for port in self._ports:
            try:
                self._socket.sendto(HELLO, (HOST, port))
            except OSError:  # nobody there; said again in a second
                continue
