"""The ground station: it hears the autopilot, asks it things and commands it, in simulated time."""

from __future__ import annotations

from collections.abc import Mapping

from bridge.dialect import Encoder, Identity, Reader, enum, make_message
from bridge.wire import FieldValue, Received
from tools.sitl.wire import Wire

GROUND = Identity(254, 190)
"""Not 255: nothing here needs the rights of a radio-control override, and this end must never hold a failsafe back."""

HEARTBEAT_NS = 1_000_000_000
_VEHICLE, _AUTOPILOT = 1, 1


class GroundStation:
    """One end of a wire.

    last: the autopilot's newest message of each name, with when it came [ns of simulated time].
    texts: its STATUSTEXTs with their times.  parameters: what it told of them.
    """

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._reader = Reader()
        self._encode = Encoder(GROUND)
        self._sequence = 0
        self._beat_ns = 0
        self.now_ns = 0
        self.last: dict[str, tuple[int, Mapping[str, FieldValue]]] = {}
        self.acks: dict[int, int] = {}
        self.texts: list[tuple[int, str]] = []
        self.parameters: dict[str, float] = {}

    def tick(self, now_ns: int) -> list[Received]:
        """Hear what has come until now, beat if it is time to; return the autopilot's new messages."""
        self.now_ns = now_ns
        if now_ns >= self._beat_ns:
            self._beat_ns = now_ns + HEARTBEAT_NS
            self.say("HEARTBEAT", type=enum("MAV_TYPE_GCS"), autopilot=enum("MAV_AUTOPILOT_INVALID"), mavlink_version=3)
        heard = [each for each in self._hear() if (each.system_id, each.component_id) == (_VEHICLE, _AUTOPILOT)]
        for message in heard:
            self.last[message.message] = now_ns, message.fields
            if message.message == "STATUSTEXT":
                self.texts.append((now_ns, str(message.fields["text"])))
            elif message.message == "PARAM_VALUE":
                self.parameters[str(message.fields["param_id"])] = float(str(message.fields["param_value"]))
            elif message.message == "COMMAND_ACK":
                self.acks[_whole(message.fields["command"])] = _whole(message.fields["result"])
        return heard

    def say(self, name: str, **fields: FieldValue) -> None:
        """Send one message."""
        self._wire.send(self._encode(make_message(name, self.now_ns, **fields), self._sequence))
        self._sequence = (self._sequence + 1) % 256

    def command(self, number: int, *values: float) -> None:
        """Send a COMMAND_LONG; its result comes to `acks`."""
        self.acks.pop(number, None)
        parameters = {f"param{k + 1}": float(value) for k, value in enumerate(values)}
        self.say("COMMAND_LONG", target_system=_VEHICLE, target_component=_AUTOPILOT, command=number, **parameters)

    def command_int(self, number: int, x: int, y: int, z: float) -> None:
        """Send a COMMAND_INT with a place in it; its result comes to `acks`."""
        self.acks.pop(number, None)
        self.say("COMMAND_INT", target_system=_VEHICLE, target_component=_AUTOPILOT, command=number, x=x, y=y, z=z)

    def field(self, message: str, name: str) -> float | None:
        """Return a number of the newest message of a name; None before the first."""
        if message not in self.last:
            return None
        value = self.last[message][1][name]
        return float(value) if isinstance(value, int | float) else None

    def close(self) -> None:
        """Close the wire."""
        self._wire.close()

    def _hear(self) -> list[Received]:
        return [message for piece in self._wire.receive() for message in self._reader.feed(piece)]


def _whole(value: FieldValue) -> int:
    return value if isinstance(value, int) else 0
