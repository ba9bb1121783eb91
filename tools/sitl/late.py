"""A wire to a serial port that opens late: knocked at while simulated time goes on, until it answers."""

from __future__ import annotations

from tools.sitl.wire import TcpWire
from tracker.errors import OperatorError

_KNOCK_MS, _PATIENCE_MS = 50, 20_000


class LateWire:
    """A connection that need not stand yet; what is sent until then is lost, as on a line that nobody holds.

    ArduPilot's simulator takes the ground station at its start, waits for physics, and opens its other serial ports
    only while those run (4.7; 4.8 at once). So whoever is asked for physics must not wait here.

    host, port: where it will listen.  It is asked what came once a simulated millisecond.
    """

    def __init__(self, host: str, port: int) -> None:
        self._host = host
        self._port = port
        self._asked_ms = 0
        self._wire: TcpWire | None = None

    def send(self, raw: bytes) -> None:
        """Send what the kernel takes."""
        if self._wire is not None:
            self._wire.send(raw)

    def receive(self) -> list[bytes]:
        """Return the bytes that came.

        Raises:
            OperatorError: it did not open within 20 s of simulated time.
        """
        if self._wire is None:
            self._knock()
        return [] if self._wire is None else self._wire.receive()

    def close(self) -> None:
        """Hang up."""
        if self._wire is not None:
            self._wire.close()

    def _knock(self) -> None:
        self._asked_ms += 1
        if self._asked_ms % _KNOCK_MS:
            return
        try:
            self._wire = TcpWire(self._host, self._port)
        except OperatorError as error:
            if self._asked_ms >= _PATIENCE_MS:
                raise OperatorError(
                    f"--connect: its SERIAL1 did not open at tcp:{self._host}:{self._port} within "
                    f"{_PATIENCE_MS / 1000:g} s of its clock; start it without a --serial1 of its own (docs/sitl.md)"
                ) from error
