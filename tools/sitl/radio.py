"""The pilot's radio, as ArduPilot's simulator hears one: by UDP, up to 4.7 the only way in.

Source: AP_RCProtocol_UDP: 16 channels of u16 [us], the newest counts.
"""

from __future__ import annotations

import struct

from tools.sitl.wire import UdpWire

RADIO_PORT = 5501
"""Where a simulator listens for its radio unless told otherwise."""

_CHANNELS = struct.Struct("<16H")
_SPARE_US = 1500


class Transmitter:
    """Send channels to a port of 127.0.0.1."""

    def __init__(self, port: int) -> None:
        self._wire = UdpWire(("127.0.0.1", port))

    def send(self, rc_us: tuple[int, ...]) -> None:
        """Send the first channels [us]; the rest are in the middle."""
        self._wire.send(_CHANNELS.pack(*rc_us, *[_SPARE_US] * (16 - len(rc_us))))

    def close(self) -> None:
        """Close the socket."""
        self._wire.close()


def free_port() -> int:
    """Return a UDP port of loopback that nobody has now."""
    probe = UdpWire()
    probe.close()
    return probe.port
