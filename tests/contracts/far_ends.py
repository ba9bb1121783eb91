"""The other ends of the links: real sockets and pseudo-terminals on which an autopilot would sit."""

from __future__ import annotations

import os
import select
import socket
import tty
from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from time import monotonic

from bridge.links import Link, MemoryLink
from tests.bridge.mavlink_by_hand import ByHand, parse, whole_frames

PATIENCE_S = 10.0
HOST = "127.0.0.1"


def eventually(condition: Callable[[], bool]) -> None:
    """Ask until it is so; fail after ten seconds."""
    deadline = monotonic() + PATIENCE_S
    while not condition():
        if monotonic() > deadline:
            raise TimeoutError("still not so after ten seconds")
        select.select([], [], [], 0.001)


class FarEnd(ABC):
    """One far end. uri: what a link to it is called."""

    uri: str

    def __init__(self) -> None:
        self._left_over = b""

    def frames(self, count: int) -> list[ByHand]:
        """Wait for so many frames and return them, decoded by hand."""
        data = self._left_over
        while len(parse(data[: whole_frames(data)])) < count:
            data += self._read()
        whole = whole_frames(data)
        self._left_over = data[whole:]
        return parse(data[:whole])

    def meet(self, link: Link) -> None:
        """Do what lets link and far end know of each other."""
        eventually(lambda: link.state().up)

    @abstractmethod
    def fileno(self) -> int:
        """Return the descriptor to wait on."""

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Send bytes to the link, which has sent before."""

    @abstractmethod
    def vanish(self) -> None:
        """Go away without a word."""

    @abstractmethod
    def come_back(self) -> None:
        """Be there again, at the same address."""

    @abstractmethod
    def take(self) -> bytes:
        """Return what has come; only called once something has."""

    def _read(self) -> bytes:
        readable, _, _ = select.select([self.fileno()], [], [], PATIENCE_S)
        if not readable:
            raise TimeoutError("nothing came in ten seconds")
        return self.take()


class UdpFar(FarEnd):
    """A host that waits for datagrams; the link is udpout."""

    def __init__(self, _: Path) -> None:
        super().__init__()
        self._port = 0
        self._peer: tuple[str, int] | None = None
        self.come_back()
        self.uri = f"udpout:{HOST}:{self._port}"

    def fileno(self) -> int:
        return self.socket.fileno()

    def write(self, data: bytes) -> None:
        assert self._peer is not None
        self.socket.sendto(data, self._peer)

    def vanish(self) -> None:
        self.socket.close()

    def come_back(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((HOST, self._port))
        self._port = self.socket.getsockname()[1]

    def take(self) -> bytes:
        data, self._peer = self.socket.recvfrom(65535)
        return data


class UdpCaller(FarEnd):
    """A host that speaks first; the link is udpin, and never learns that its peer is gone."""

    def __init__(self, _: Path) -> None:
        super().__init__()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind((HOST, 0))
            self._port = probe.getsockname()[1]
        self.uri = f"udpin:{HOST}:{self._port}"
        self.come_back()

    def meet(self, link: Link) -> None:
        self.write(b"!")
        eventually(lambda: link.receive() == b"!")

    def fileno(self) -> int:
        return self.socket.fileno()

    def write(self, data: bytes) -> None:
        self.socket.send(data)

    def vanish(self) -> None:
        self.socket.close()

    def come_back(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect((HOST, self._port))

    def take(self) -> bytes:
        return self.socket.recv(65535)


class SerialFar(FarEnd):
    """The master of a pseudo-terminal; the link's device is a symbolic link that can be pointed at another."""

    baud = 921600

    def __init__(self, directory: Path) -> None:
        super().__init__()
        self._device = directory / "ttyAutopilot"
        self.uri = f"serial:{self._device}:{self.baud}"
        self.come_back()

    def fileno(self) -> int:
        return self._master

    def write(self, data: bytes) -> None:
        os.write(self._master, data)

    def vanish(self) -> None:
        self._device.unlink()
        os.close(self._master)
        os.close(self._slave)

    def come_back(self) -> None:
        # The slave stays open here too: a master whose slave nobody holds reads as an error.
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self._device.symlink_to(os.ttyname(self._slave))

    def take(self) -> bytes:
        return os.read(self._master, 65536)


class SlowSerialFar(SerialFar):
    """The same at 115200 baud."""

    baud = 115200


class PacedSerialFar(SerialFar):
    """The same at 57600 baud, and read as fast as such a line carries, a quarter of a second caught up with at most."""

    baud = 57600

    def __init__(self, directory: Path) -> None:
        super().__init__(directory)
        self._read_at, self._credit = monotonic(), 0.0

    def take(self) -> bytes:
        rate = self.baud / 10
        now = monotonic()
        self._credit = min(self._credit + (now - self._read_at) * rate, rate / 4)
        self._read_at = now
        data = os.read(self._master, int(self._credit)) if self._credit >= 1.0 else b""
        self._credit -= len(data)
        return data


class TcpFar(FarEnd):
    """A server; the link connects."""

    def __init__(self, _: Path) -> None:
        super().__init__()
        self._port = 0
        self.come_back()
        self.uri = f"tcp:{HOST}:{self._port}"

    def meet(self, link: Link) -> None:
        super().meet(link)
        self.accept()

    def accept(self) -> None:
        """Take the link's connection."""
        self._connection, _ = self._server.accept()

    def fileno(self) -> int:
        return self._connection.fileno()

    def write(self, data: bytes) -> None:
        self._connection.sendall(data)

    def vanish(self) -> None:
        self._server.close()
        self._connection.close()

    def come_back(self) -> None:
        self._server = socket.create_server((HOST, self._port))
        self._server.settimeout(PATIENCE_S)
        self._port = self._server.getsockname()[1]

    def take(self) -> bytes:
        return self._connection.recv(65536)


class MemoryFar(FarEnd):
    """The link itself: its frames are already at their far end."""

    uri = "memory:"

    def __init__(self, _: Path) -> None:
        super().__init__()

    def meet(self, link: Link) -> None:
        assert isinstance(link, MemoryLink)
        self._link = link

    def fileno(self) -> int:
        raise NotImplementedError

    def write(self, data: bytes) -> None:
        self._link.deliver(data)

    def vanish(self) -> None:
        """Do nothing: memory does not vanish."""

    def come_back(self) -> None:
        """Do nothing: memory does not vanish."""

    def _read(self) -> bytes:
        return self.take()

    def take(self) -> bytes:
        return self._link.frames.popleft()


NOTICED: tuple[Callable[[Path], FarEnd], ...] = (UdpFar, SerialFar, SlowSerialFar, TcpFar)
"""Far ends whose going the link notices."""
UNNOTICED: tuple[Callable[[Path], FarEnd], ...] = (UdpCaller, MemoryFar)
