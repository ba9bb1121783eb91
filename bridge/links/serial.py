"""Serial ports, through pyserial."""

from __future__ import annotations

import contextlib
import errno
import math
import termios

import serial
from serial.tools import list_ports

from bridge.clock import Nanoseconds
from bridge.links.ledger import Ledger
from bridge.links.stream import StreamLink
from bridge.links.uri import BITS_PER_BYTE, Address
from tracker.errors import OperatorError

_WRITE_TIMEOUT_S = 0.5
_MIN_POLL_S = 0.001


class SerialPort:
    """One open serial port, 8N1 without flow control, locked against other programs. Every failure is an OSError.

    What lies between us and the wire is counted twice: by the kernel, and by what a line of this baud can have carried
    since it was written. USB adapters and pseudo-terminals take kilobytes into buffers of their own and report nothing:
    without the second count seconds of old poses would wait there.

    device: path.  baud: bits a second.  stopwatch: reads a running time [ns].
    """

    low_water_bytes = 16

    def __init__(self, device: str, baud: int, stopwatch: Nanoseconds) -> None:
        self.poll_s = max(_MIN_POLL_S, self.low_water_bytes * BITS_PER_BYTE / baud)
        self._byte_ns = 1e9 * BITS_PER_BYTE / baud
        self._stopwatch = stopwatch
        self._carried_ns = 0.0  # when the line will have carried all that was written
        try:
            self._serial = serial.Serial(device, baud, timeout=0, write_timeout=_WRITE_TIMEOUT_S, exclusive=True)
        except (ValueError, OverflowError, termios.error) as error:
            raise OSError(errno.EINVAL, f"{device} refuses {baud} baud ({error})") from error

    def fileno(self) -> int:
        """Return the descriptor."""
        return int(self._serial.fileno())

    def write(self, data: bytes) -> None:
        """Hand all of `data` to the kernel within half a second."""
        self._serial.write(data)
        self._carried_ns = max(self._carried_ns, self._stopwatch()) + len(data) * self._byte_ns

    def read(self) -> bytes:
        """Return what came in; pyserial raises when the device is gone."""
        return bytes(self._serial.read(max(1, self._serial.in_waiting)))

    def pending(self) -> int:
        """Return how many bytes have not left yet."""
        on_the_way = math.ceil((self._carried_ns - self._stopwatch()) / self._byte_ns)
        return max(int(self._serial.out_waiting), on_the_way)

    def close(self) -> None:
        """Close the port."""
        self._serial.close()

    def discard(self) -> None:
        """Close the port without its output: closing a stalled port may otherwise wait 30 s in the kernel."""
        with contextlib.suppress(OSError, termios.error):
            self._serial.reset_output_buffer()
        with contextlib.suppress(OSError):
            self._serial.close()


def open_serial(address: Address, ledger: Ledger) -> StreamLink:
    """Open a serial link.

    Raises:
        OperatorError: no such device (lists those there are), no permission, in use, a baud the device refuses.
    """

    def open_port() -> SerialPort:
        return SerialPort(address.place, address.number, ledger.now_ns)

    try:
        return StreamLink(open_port(), open_port, ledger)
    except OSError as error:
        raise OperatorError(f"link {address.uri}: {_advice(address.place, error)}") from error


def _advice(device: str, error: OSError) -> str:
    """Say what an operator can do about a port that does not open."""
    if error.errno == errno.ENOENT:
        found = ", ".join(sorted(port.device for port in list_ports.comports())) or "none"
        return f"no device {device}; serial ports found: {found}; plug it in or correct the path"
    if error.errno == errno.EACCES:
        return f"no permission for {device}; add yourself to its group (often dialout) and log in again"
    if error.errno == errno.EAGAIN:
        return f"{device} is in use; close the other program that holds it"
    return f"cannot open {device} ({error}); check that it is a serial port and the baud one it knows"
