"""TCP client links, as simulators and Wi-Fi bridges offer them."""

from __future__ import annotations

import contextlib
import fcntl
import socket
import struct
import termios

from bridge.links.ledger import Ledger
from bridge.links.stream import StreamLink
from bridge.links.uri import Address
from tracker.errors import OperatorError

_TIMEOUT_S = 1.0
_INT = struct.Struct("i")
_NOTHING = bytes(_INT.size)


class TcpPort:
    """One TCP connection. Every failure is an OSError."""

    # About one estimate's messages may be unacknowledged: enough for 30 Hz at 30 ms of round trip, and little
    # enough that a gap in the air does not end in a burst of old poses.
    low_water_bytes = 512
    poll_s = 0.002

    def __init__(self, host: str, port: int) -> None:
        try:
            self._socket = socket.create_connection((host, port), timeout=_TIMEOUT_S)
        except UnicodeError as error:  # a name with an empty or overlong part
            raise socket.gaierror(socket.EAI_NONAME, str(error)) from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def fileno(self) -> int:
        """Return the descriptor."""
        return self._socket.fileno()

    def write(self, data: bytes) -> None:
        """Hand all of `data` to the kernel within a second."""
        self._socket.sendall(data)

    def read(self) -> bytes:
        """Return what came in."""
        data = self._socket.recv(4096)
        if not data:
            raise ConnectionResetError("closed by the other end")
        return data

    def pending(self) -> int:
        """Return how many bytes the other end has not acknowledged (SIOCOUTQ, the same number as TIOCOUTQ)."""
        count: int = _INT.unpack(fcntl.ioctl(self._socket, termios.TIOCOUTQ, _NOTHING))[0]
        return count

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def discard(self) -> None:
        """Close the connection; the kernel forgets what it holds with it."""
        with contextlib.suppress(OSError):
            self._socket.close()


def open_tcp(address: Address, ledger: Ledger) -> StreamLink:
    """Connect a TCP link.

    Raises:
        OperatorError: a host that does not resolve, nobody listening, no way there.
    """

    def open_port() -> TcpPort:
        return TcpPort(address.place, address.number)

    try:
        return StreamLink(open_port(), open_port, ledger)
    except OSError as error:
        raise OperatorError(f"link {address.uri}: {_advice(address, error)}") from error


def _advice(address: Address, error: OSError) -> str:
    """Say what an operator can do about a connection that is not made."""
    if isinstance(error, socket.gaierror):
        return f"host {address.place} does not resolve ({error.strerror}); check its name or give an IP address"
    if isinstance(error, ConnectionRefusedError):
        return "nobody listens there; start the autopilot or simulator first"
    return f"cannot connect ({error}); check the address and the network"
