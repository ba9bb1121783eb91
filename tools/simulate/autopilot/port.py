"""One serial port of the autopilot, as a UDP socket on loopback."""

from __future__ import annotations

import socket

from bridge.dialect import Encoder, Identity, Reader
from bridge.wire import Message, Received
from tools.simulate.autopilot.jitter import JitterCorrection

_DATAGRAM_BYTES = 65535


class Port:
    """Speak with whoever spoke last; say nothing before anyone did.

    wanted: names of messages and the time between two of them [ns], as SET_MESSAGE_INTERVAL asked for.
    """

    def __init__(self, identity: Identity) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.bind(("127.0.0.1", 0))
        self._encode = Encoder(identity)
        self._peer: tuple[str, int] | None = None
        self._sequence = 0
        self.number = int(self._socket.getsockname()[1])
        self.restart()

    def restart(self) -> None:
        """Forget all but the socket and the peer, as a reboot does."""
        self._reader = Reader()
        self._due_ns: dict[str, int] = {}
        self.clock = JitterCorrection()
        self.wanted: dict[str, int] = {"HEARTBEAT": 1_000_000_000, "TIMESYNC": 10_000_000_000}

    def receive(self) -> list[Received]:
        """Return the messages that came since the last call."""
        messages: list[Received] = []
        while True:
            try:
                data, self._peer = self._socket.recvfrom(_DATAGRAM_BYTES)
            except BlockingIOError:
                return messages
            except ConnectionRefusedError:  # the peer has gone; it may come back
                continue
            messages += self._reader.feed(data)

    def due(self, now_ns: int) -> list[str]:
        """Return the names of the messages whose time has come."""
        names = []
        for name, period_ns in self.wanted.items():
            at_ns = self._due_ns.get(name, now_ns)
            if now_ns >= at_ns:
                names.append(name)
                self._due_ns[name] = max(at_ns + period_ns, now_ns)
        return names

    def send(self, message: Message) -> None:
        """Send a message of the autopilot's own."""
        self.forward(self._encode(message, self._sequence))
        self._sequence = (self._sequence + 1) % 256

    def forward(self, raw: bytes) -> None:
        """Send a frame as it is; what the kernel does not take is lost, as on a full serial port."""
        if self._peer is None:
            return
        try:
            self._socket.sendto(raw, self._peer)
        except (BlockingIOError, ConnectionRefusedError):
            return

    def close(self) -> None:
        """Let go of the socket."""
        self._socket.close()
