"""Values to MAVLink 2 and back: the only module that knows pymavlink's dialect."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from operator import itemgetter
from types import MappingProxyType
from typing import NamedTuple

# The v20 dialect always frames MAVLink 2; mavutil would look at the environment and may cut the extension fields.
from pymavlink.dialects.v20 import common

from bridge.ned import NedFrame, NedPose, NedVelocity
from bridge.wire import FieldValue, Message, Received
from tracker.errors import OperatorError
from tracker.types import Estimate

Fields = dict[str, FieldValue]
HEARTBEAT = "HEARTBEAT"

_HEAD = struct.Struct("<BBBBBBHB")  # of a MAVLink 2 frame, behind the marker
_MARKER = re.compile(rb"[\xfd\xfe]")
_CLASSES = {dialect_class.msgname: dialect_class for dialect_class in common.mavlink_map.values()}
_HEARTBEAT_FIELDS = MappingProxyType(
    {
        "type": int(common.MAV_TYPE_ONBOARD_CONTROLLER),
        "autopilot": int(common.MAV_AUTOPILOT_INVALID),
        "base_mode": 0,
        "custom_mode": 0,
        "system_status": int(common.MAV_STATE_ACTIVE),
        "mavlink_version": 3,
    }
)


@dataclass(frozen=True, slots=True)
class Identity:
    """Who speaks: the vehicle's system id, and a component id (197: visual-inertial odometry).

    Raises:
        OperatorError: a system id outside 1..254 or a component id outside 1..255.
    """

    system_id: int
    component_id: int = int(common.MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY)

    def __post_init__(self) -> None:
        # 255 is the ground station: its heartbeats would hold back the autopilot's ground-station failsafe.
        if not 1 <= self.system_id <= 254:
            raise OperatorError(
                f"system_id: {self.system_id} must be 1 to 254; give the vehicle's own (255 is the ground station's)"
            )
        if not 1 <= self.component_id <= 255:
            raise OperatorError(f"component_id: {self.component_id} must be 1 to 255; 197 is the usual one")


def _vision_position(estimate: Estimate, pose: NedPose) -> Fields:
    x, y, z = pose.p_BinN
    roll, pitch, yaw = pose.euler
    return {
        "usec": estimate.t_ns // 1000,
        "x": x,
        "y": y,
        "z": z,
        "roll": roll,
        "pitch": pitch,
        "yaw": yaw,
        "covariance": pose.covariance,
        "reset_counter": estimate.reset_counter,
    }


def _att_pos_mocap(estimate: Estimate, pose: NedPose) -> Fields:
    x, y, z = pose.p_BinN
    return {
        "time_usec": estimate.t_ns // 1000,
        "q": pose.q_FtoN,
        "x": x,
        "y": y,
        "z": z,
        "covariance": pose.covariance,
    }


def _vision_speed(estimate: Estimate, velocity: NedVelocity) -> Fields:
    x, y, z = velocity.v_BinN
    return {
        "usec": estimate.t_ns // 1000,
        "x": x,
        "y": y,
        "z": z,
        "covariance": velocity.covariance,
        "reset_counter": estimate.reset_counter,
    }


_POSE_FILL: Mapping[str, Callable[[Estimate, NedPose], Fields]] = MappingProxyType(
    {"VISION_POSITION_ESTIMATE": _vision_position, "ATT_POS_MOCAP": _att_pos_mocap}
)
_VELOCITY_FILL: Mapping[str, Callable[[Estimate, NedVelocity], Fields]] = MappingProxyType(
    {"VISION_SPEED_ESTIMATE": _vision_speed}
)
MESSAGES = (*_POSE_FILL, *_VELOCITY_FILL)
"""The messages a link may be given; every link gets heartbeats besides."""


class Packer:
    """Make MAVLink messages of estimates.

    room_yaw_deg: heading of the room's x axis, clockwise from north [deg].
    """

    def __init__(self, room_yaw_deg: float) -> None:
        self._frame = NedFrame(room_yaw_deg)

    def messages(self, estimate: Estimate, names: Iterable[str]) -> dict[str, Message]:
        """Return the messages named (of `MESSAGES`) by name; the turn into NED is done once for all of them."""
        t_ns, available_ns = estimate.t_ns, estimate.available_ns
        packed: dict[str, Message] = {}
        pose: NedPose | None = None
        for name in names:
            if name in _POSE_FILL:
                pose = pose or self._frame.pose(estimate)
                fields = _POSE_FILL[name](estimate, pose)
            else:
                fields = _VELOCITY_FILL[name](estimate, self._frame.velocity(estimate))
            packed[name] = Message(name, t_ns, available_ns, MappingProxyType(fields))
        return packed


def heartbeat(t_ns: int) -> Message:
    """Return the heartbeat of stream time t_ns [ns]."""
    return Message(HEARTBEAT, t_ns, 0, _HEARTBEAT_FIELDS)


class _Layout(NamedTuple):
    """How a message's payload is laid out: its fields in the wire's order, what packs them, its number's two halves,
    and the byte of its own in the checksum."""

    pick: Callable[[Mapping[str, FieldValue]], tuple[FieldValue, ...]]
    pack: Callable[..., bytes]
    low: int
    high: int
    extra: bytes


@cache
def _layout(name: str) -> _Layout:
    dialect_class = _CLASSES[name]
    number = dialect_class.id
    return _Layout(
        itemgetter(*dialect_class.ordered_fieldnames),
        dialect_class.unpacker.pack,
        number & 0xFFFF,
        number >> 16,
        bytes((dialect_class.crc_extra,)),
    )


class Encoder:
    """Frame messages for one link, by the dialect's own tables.

    pymavlink's `pack` makes the same bytes, as a test shows, and takes six times as long.
    """

    def __init__(self, identity: Identity) -> None:
        self._identity = identity.system_id, identity.component_id

    def __call__(self, message: Message, sequence: int) -> bytes:
        """Return the whole MAVLink 2 frame with the sequence number, 0..255.

        Source: the MAVLink serialisation guide: fields by size, zeros at the end of the payload left out but for its
        first byte, checksum over all but the marker, and over the message's own extra byte.
        """
        pick, pack, low, high, extra = _layout(message.name)
        values: list[object] = []
        for value in pick(message.fields):
            if isinstance(value, list):
                values += value
            else:
                values.append(value.encode() if isinstance(value, str) else value)
        packed = pack(*values)
        payload = packed.rstrip(b"\0") or packed[:1]
        system_id, component_id = self._identity
        body = _HEAD.pack(len(payload), 0, 0, sequence, system_id, component_id, low, high) + payload
        checksum: int = common.x25crc(body + extra).crc
        return b"\xfd%b%b" % (body, checksum.to_bytes(2, "little"))


class Reader:
    """Cut a byte stream into MAVLink messages, version 1 or 2; what is no whole valid frame is passed over.

    pymavlink's own stream parser trusts the length byte of a broken frame and swallows the good ones behind it;
    here a frame that fails its checksum costs one byte, and the search goes on behind its marker.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._mav = common.MAVLink(None)

    def feed(self, data: bytes) -> list[Received]:
        """Take the next bytes, in pieces of any size, and return the messages they complete."""
        self._buffer += data
        received = []
        at = 0
        while marker := _MARKER.search(self._buffer, at):
            at = marker.start()
            length = _frame_length(self._buffer[at : at + 10])
            if length > len(self._buffer) - at:
                break
            message = self._decode(self._buffer[at : at + length])
            if message is None:
                at += 1
            else:
                received.append(message)
                at += length
        else:
            at = len(self._buffer)
        del self._buffer[:at]
        return received

    def _decode(self, raw: bytearray) -> Received | None:
        if not raw:
            return None
        try:
            message = self._mav.decode(raw)
        except common.MAVError:
            return None
        fields = message.to_dict()
        name = fields.pop("mavpackettype")
        return Received(
            name, message.get_srcSystem(), message.get_srcComponent(), message.get_seq(), fields, bytes(raw)
        )


def _frame_length(header: bytearray) -> int:
    """Return the length of the frame that starts so, in bytes; 0 if none can, more than given while unsure.

    Source: the MAVLink serialisation guide: version 1 has 6 bytes of header, version 2 has 10; both have 2 of
    checksum, version 2 has 13 of signature if the first incompatibility flag says so. Other flags must be refused.
    """
    version_1 = header[0] == common.PROTOCOL_MARKER_V1
    needed = int(common.HEADER_LEN_V1 if version_1 else common.HEADER_LEN_V2)
    if len(header) < needed:
        return needed
    message_id = header[5] if version_1 else int.from_bytes(header[7:10], "little")
    if message_id not in common.mavlink_map or (not version_1 and header[2] & ~common.MAVLINK_IFLAG_SIGNED):
        return 0
    signature = common.MAVLINK_SIGNATURE_BLOCK_LEN if not version_1 and header[2] else 0
    return int(needed + header[1] + 2 + signature)
