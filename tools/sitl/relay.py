"""The wire between bridge and autopilot, with losses on demand: two UDP sockets, moved on in simulated time."""

from __future__ import annotations

import socket

import numpy as np

_DATAGRAM_BYTES = 65535


class Relay:
    """Pass datagrams both ways.

    far: where the autopilot listens; None to wait for its call.  loss: share of datagrams lost, either way.
    """

    def __init__(self, far: tuple[str, int] | None, seed: int = 0) -> None:
        self._bridge_side, self._far_side = _socket(), _socket()
        self._bridge: tuple[str, int] | None = None
        self._far = far
        self._rng = np.random.default_rng(seed)
        self.loss = 0.0
        self.lost = 0
        self.bridge_port = int(self._bridge_side.getsockname()[1])
        self.far_port = int(self._far_side.getsockname()[1])

    def pump(self) -> None:
        """Pass on what has come."""
        self._bridge = self._pass(self._bridge_side, self._far_side, self._far) or self._bridge
        self._far = self._pass(self._far_side, self._bridge_side, self._bridge) or self._far

    def close(self) -> None:
        """Close both sockets."""
        self._bridge_side.close()
        self._far_side.close()

    def _pass(self, source: socket.socket, out: socket.socket, to: tuple[str, int] | None) -> tuple[str, int] | None:
        """Pass everything from one socket on by the other; return who sent the last, None if nobody did."""
        peer: tuple[str, int] | None = None
        while True:
            try:
                data, peer = source.recvfrom(_DATAGRAM_BYTES)
            except BlockingIOError:
                return peer
            except ConnectionRefusedError:
                continue
            if self._rng.random() < self.loss:
                self.lost += 1
            elif to is not None:
                out.sendto(data, to)


def _socket() -> socket.socket:
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.setblocking(False)
    opened.bind(("127.0.0.1", 0))
    return opened
