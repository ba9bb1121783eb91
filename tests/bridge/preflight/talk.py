"""The autopilot's side of a talk, framed and read by pymavlink itself."""

from __future__ import annotations

import struct

from pymavlink.dialects.v20 import ardupilotmega

from bridge.dialect import Encoder, Identity, Reader
from bridge.wire import Message, Received

_speaker = ardupilotmega.MAVLink(None, srcSystem=1, srcComponent=1)
_to_wire = Encoder(Identity(1))


def heard(message: ardupilotmega.MAVLink_message) -> Received:
    """Return a message as the bridge's reader takes it off the wire."""
    (received,) = Reader().feed(bytes(message.pack(_speaker)))
    return received


def said(message: Message) -> ardupilotmega.MAVLink_message:
    """Return the bridge's message as pymavlink, not ours, reads it."""
    (parsed,) = ardupilotmega.MAVLink(None).parse_buffer(_to_wire(message, 0))
    return parsed


class Store:
    """Parameters as an autopilot keeps them.

    values: by name, number and MAV_PARAM_TYPE.  bytewise: PX4's encoding.  deaf: so many questions go unheard.
    stubborn: names whose writes do not stick.
    """

    def __init__(self, values: dict[str, tuple[float, int]], bytewise: bool = False) -> None:
        self.values = dict(values)
        self.bytewise = bytewise
        self.deaf = 0
        self.stubborn: set[str] = set()

    def answer(self, message: Message) -> list[Received]:
        """Take the bridge's message, and answer as the autopilots do: an unknown name with silence."""
        asked = said(message)
        if self.deaf:
            self.deaf -= 1
            return []
        name = asked.param_id
        if name not in self.values:
            return []
        if asked.get_type() == "PARAM_SET" and name not in self.stubborn:
            self.values[name] = (self._decoded(asked), self.values[name][1])
        return [self.told(name)]

    def told(self, name: str) -> Received:
        """Return the PARAM_VALUE of a parameter."""
        value, kind = self.values[name]
        floats = struct.pack("<f", value)
        if self.bytewise and kind == ardupilotmega.MAV_PARAM_TYPE_INT32:
            floats = struct.pack("<i", int(value))
        message = ardupilotmega.MAVLink_param_value_message(name.encode(), 0.0, kind, len(self.values), 0)
        raw = bytearray(message.pack(_speaker))
        raw[10:14] = floats
        crc = ardupilotmega.x25crc(bytes(raw[1:-2]) + bytes((message.crc_extra,))).crc
        raw[-2:] = crc.to_bytes(2, "little")
        (received,) = Reader().feed(bytes(raw))
        return received

    def _decoded(self, asked: ardupilotmega.MAVLink_message) -> float:
        raw = bytes(asked.get_msgbuf())[10:14]
        if self.bytewise and asked.param_type == ardupilotmega.MAV_PARAM_TYPE_INT32:
            return float(struct.unpack("<i", raw)[0])
        return float(struct.unpack("<f", raw)[0])
