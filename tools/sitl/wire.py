"""Wires to an autopilot's serial port, never waited for: UDP on loopback, and TCP to one that runs already."""

from __future__ import annotations

import socket
from typing import Protocol

from tracker.errors import OperatorError

_PIECE_BYTES = 65535
_PATIENCE_S = 5.0


class Wire(Protocol):
    """Carry bytes both ways."""

    def send(self, raw: bytes) -> None:
        """Send, or lose what cannot go now."""

    def receive(self) -> list[bytes]:
        """Return what has come since the last call, in the pieces it came in."""

    def close(self) -> None:
        """Let go of it."""


class UdpWire:
    """A socket on loopback. far: where to send; None to answer whoever called last.  port: its own."""

    def __init__(self, far: tuple[str, int] | None = None) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.bind(("127.0.0.1", 0))
        self._far = far
        self.port = int(self._socket.getsockname()[1])

    def send(self, raw: bytes) -> None:
        """Send one datagram; before anyone called, nobody is there."""
        if self._far is not None:
            try:
                self._socket.sendto(raw, self._far)
            except (BlockingIOError, ConnectionRefusedError):
                return

    def receive(self) -> list[bytes]:
        """Return the datagrams that came."""
        pieces: list[bytes] = []
        while True:
            try:
                data, self._far = self._socket.recvfrom(_PIECE_BYTES)
            except BlockingIOError:
                return pieces
            except ConnectionRefusedError:  # the peer has gone; it may come back
                continue
            pieces.append(data)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class TcpWire:
    """A connection to a serial port that listens."""

    def __init__(self, host: str, port: int) -> None:
        """Connect.

        Raises:
            OperatorError: nobody listens there.
        """
        try:
            self._socket = socket.create_connection((host, port), _PATIENCE_S)
        except OSError as error:
            raise OperatorError(f"nobody listens at tcp:{host}:{port} ({error.strerror or error})") from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.setblocking(False)

    def send(self, raw: bytes) -> None:
        """Send what the kernel takes."""
        try:
            self._socket.send(raw)
        except (BlockingIOError, ConnectionError):
            return

    def receive(self) -> list[bytes]:
        """Return the bytes that came."""
        pieces: list[bytes] = []
        while True:
            try:
                data = self._socket.recv(_PIECE_BYTES)
            except (BlockingIOError, ConnectionError):
                return pieces
            if not data:
                return pieces
            pieces.append(data)

    def close(self) -> None:
        """Hang up."""
        self._socket.close()
