"""MAVLink 2 messages to bytes and back: the only module that knows pymavlink's dialect."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from operator import itemgetter
from types import MappingProxyType
from typing import Any, NamedTuple

from fastcrc.crc16 import mcrf4xx

# The v20 dialect always frames MAVLink 2; mavutil would look at the environment and may cut the extension fields.
# ArduPilot's dialect holds the common one, and its own EKF_STATUS_REPORT.
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.signing.signature import SIGNED, Signing
from bridge.wire import FieldValue, Message, Received
from tracker.errors import OperatorError

GROUND_STATION_ID = 255

_HEAD = struct.Struct("<BBBBBBHB")  # of a MAVLink 2 frame, behind the marker
_MARKER = re.compile(rb"[\xfd\xfe]")
_CLASSES = {dialect_class.msgname: dialect_class for dialect_class in dialect.mavlink_map.values()}


@dataclass(frozen=True, slots=True)
class Identity:
    """Who speaks: the vehicle's system id, and a component id (197: visual-inertial odometry).

    Raises:
        OperatorError: a system id outside 1..254 or a component id outside 1..255.
    """

    system_id: int
    component_id: int = int(dialect.MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY)

    def __post_init__(self) -> None:
        # 255 is the ground station: its heartbeats would hold back the autopilot's ground-station failsafe.
        if not 1 <= self.system_id <= 254:
            raise OperatorError(
                f"system_id: {self.system_id} must be 1 to 254; give the vehicle's own (255 is the ground station's)"
            )
        if not 1 <= self.component_id <= 255:
            raise OperatorError(f"component_id: {self.component_id} must be 1 to 255; 197 is the usual one")


def enum(name: str) -> int:
    """Return a constant of the dialect, such as MAV_CMD_REQUEST_MESSAGE."""
    return int(getattr(dialect, name))


def message_id(name: str) -> int:
    """Return a message's number by its name."""
    return int(_CLASSES[name].id)


def frame_bytes(name: str) -> int:
    """Return how long a message's unsigned MAVLink 2 frame is at most [bytes]."""
    return int(_CLASSES[name].unpacker.size) + 2 + int(dialect.HEADER_LEN_V2)


def make_message(name: str, t_ns: int, slot: str = "", /, **fields: FieldValue) -> Message:
    """Return any message of the dialect; fields left out are zero, a text is cut to its field's length.

    Args:
        name: its MAVLink name.  t_ns: stream time it speaks of [ns].  slot: see `bridge.wire.Message`.
    Raises:
        KeyError: a name or field the dialect does not know.
    """
    dialect_class = _CLASSES[name]
    kinds = dict(zip(dialect_class.fieldnames, dialect_class.fieldtypes, strict=True))
    known = zip(dialect_class.ordered_fieldnames, dialect_class.array_lengths, strict=True)  # in the wire's order
    whole = {field: _as_sent(fields.get(field), kinds[field], length) for field, length in known}
    if unknown := fields.keys() - whole:
        raise KeyError(f"{name} has no field {', '.join(sorted(unknown))}")
    return Message(name, t_ns, 0, MappingProxyType(whole), slot)


def _as_sent(value: FieldValue | None, kind: str, length: int) -> FieldValue:
    """Return a field's value as it goes on the wire, zero when none is given."""
    if value is None:
        return "" if kind == "char" else [0] * length if length else 0
    if isinstance(value, str):
        return value.encode("ascii", "replace")[:length].decode("ascii")
    if kind != "float":
        return value
    return _rounded(value) if isinstance(value, list) else _rounded([value])[0]


def _rounded(values: Sequence[float]) -> list[float]:
    """Round to the 32 bits that go on the wire."""
    form = struct.Struct(f"<{len(values)}f")
    return list(form.unpack(form.pack(*values)))


class _Layout(NamedTuple):
    """How a message's payload is laid out.

    pick: gives its fields in the wire's order.  texts, arrays: which of them are of those kinds, the last one first.
    pack: packs them, arrays one by one.  low, high: its number's two halves.  extra: its own byte in the checksum.
    """

    pick: Callable[[Mapping[str, FieldValue]], tuple[FieldValue, ...]]
    texts: tuple[int, ...]
    arrays: tuple[int, ...]
    pack: Callable[..., bytes]
    low: int
    high: int
    extra: bytes


@cache
def _layout(name: str) -> _Layout:
    dialect_class = _CLASSES[name]
    number, names = dialect_class.id, tuple(dialect_class.ordered_fieldnames)
    kinds = dict(zip(dialect_class.fieldnames, dialect_class.fieldtypes, strict=True))
    is_text = [kinds[field] == "char" for field in names]
    places = range(len(names) - 1, -1, -1)
    return _Layout(
        itemgetter(*names) if len(names) > 1 else lambda fields: (fields[names[0]],),
        tuple(k for k in places if is_text[k]),
        tuple(k for k in places if dialect_class.array_lengths[k] and not is_text[k]),
        dialect_class.unpacker.pack,
        number & 0xFFFF,
        number >> 16,
        bytes((dialect_class.crc_extra,)),
    )


class Encoder:
    """Frame messages for one link, by the dialect's own tables.

    pymavlink's `pack` makes the same bytes, as a test shows, and takes six times as long.
    signing: signs every frame, None for none.
    """

    def __init__(self, identity: Identity, signing: Signing | None = None) -> None:
        self._identity = identity.system_id, identity.component_id
        self._signing = signing

    def speak_for(self, system_id: int) -> None:
        """Speak for this vehicle from now on; 255 is no vehicle's."""
        if system_id != GROUND_STATION_ID:
            self._identity = system_id, self._identity[1]

    def __call__(self, message: Message, sequence: int) -> bytes:
        """Return the whole MAVLink 2 frame with the sequence number, 0..255.

        Source: the MAVLink serialisation guide: fields by size, zeros at the end of the payload left out but for its
        first byte, checksum over all but the marker, and over the message's own extra byte.
        """
        pick, texts, arrays, pack, low, high, extra = _layout(message.name)
        values: list[Any] = [*pick(message.fields)]
        for k in texts:
            values[k] = values[k].encode()
        for k in arrays:
            values[k : k + 1] = values[k]
        packed = pack(*values)
        payload = packed.rstrip(b"\0") or packed[:1]
        flags = 0 if self._signing is None else SIGNED
        body = _HEAD.pack(len(payload), flags, 0, sequence, *self._identity, low, high) + payload
        frame = b"\xfd" + body + mcrf4xx(body + extra).to_bytes(2, "little")
        return frame if self._signing is None else self._signing.sign(frame)


class Reader:
    """Cut a byte stream into MAVLink messages, version 1 or 2; what is no whole valid frame is passed over.

    pymavlink's own stream parser trusts the length byte of a broken frame and swallows the good ones behind it;
    here a frame that fails its checksum costs one byte, and the search goes on behind its marker.
    signing: with it, whole frames that are not rightly signed are passed over.
    """

    def __init__(self, signing: Signing | None = None) -> None:
        self._signing = signing
        self._buffer = bytearray()
        self._mav = dialect.MAVLink(None)

    def feed(self, data: bytes, arrived_ns: int = 0) -> list[Received]:
        """Take the next bytes, in pieces of any size, and return the messages they complete.

        arrived_ns: stream time at which they were read [ns].
        """
        self._buffer += data
        received = []
        at = 0
        while marker := _MARKER.search(self._buffer, at):
            at = marker.start()
            length = _frame_length(self._buffer[at : at + 10])
            if length > len(self._buffer) - at:
                break
            message = self._decode(self._buffer[at : at + length], arrived_ns)
            if message is None:
                at += 1
            else:
                at += length
                if self._believes(message):
                    received.append(message)
        else:
            at = len(self._buffer)
        del self._buffer[:at]
        return received

    def _believes(self, message: Received) -> bool:
        if self._signing is None:
            return True
        number = message_id(message.message)
        return self._signing.admits(message.raw, number, message.system_id, message.component_id)

    def _decode(self, raw: bytearray, arrived_ns: int) -> Received | None:
        if not raw:
            return None
        try:
            message = self._mav.decode(raw)
        except dialect.MAVError:
            return None
        fields = message.to_dict()
        name = fields.pop("mavpackettype")
        return Received(
            name, message.get_srcSystem(), message.get_srcComponent(), message.get_seq(), fields, bytes(raw), arrived_ns
        )


def _frame_length(header: bytearray) -> int:
    """Return the length of the frame that starts so, in bytes; 0 if none can, more than given while unsure.

    Source: the MAVLink serialisation guide: version 1 has 6 bytes of header, version 2 has 10; both have 2 of
    checksum, version 2 has 13 of signature if the first incompatibility flag says so. Other flags must be refused.
    """
    version_1 = header[0] == dialect.PROTOCOL_MARKER_V1
    needed = int(dialect.HEADER_LEN_V1 if version_1 else dialect.HEADER_LEN_V2)
    if len(header) < needed:
        return needed
    message_id = header[5] if version_1 else int.from_bytes(header[7:10], "little")
    if message_id not in dialect.mavlink_map or (not version_1 and header[2] & ~dialect.MAVLINK_IFLAG_SIGNED):
        return 0
    signature = dialect.MAVLINK_SIGNATURE_BLOCK_LEN if not version_1 and header[2] else 0
    return int(needed + header[1] + 2 + signature)
