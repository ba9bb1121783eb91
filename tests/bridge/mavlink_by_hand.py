"""An independent MAVLink 2 parser, written from the serialisation guide and the XML definitions alone.

It shares no code and no number with pymavlink: the checksum seeds are computed from the field lists below, so a
wrong field, type or order shows as a wrong checksum.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

Value = int | float | list[float]

_FORMATS = {"uint64_t": "Q", "uint32_t": "I", "float": "f", "uint8_t": "B", "int8_t": "b", "int64_t": "q"}


@dataclass(frozen=True)
class Field:
    """One field as in the XML: its type, name and array length (0: no array)."""

    type: str
    name: str
    length: int = 0


@dataclass(frozen=True)
class Definition:
    """One message as in the XML, its fields in wire order: the base ones by size, the extensions as written."""

    name: str
    base: tuple[Field, ...]
    extensions: tuple[Field, ...] = ()

    def seed(self) -> int:
        """Return CRC_EXTRA: the checksum of the name and the base fields, its two bytes folded into one."""
        crc = crc_x25(f"{self.name} ".encode())
        for field in self.base:
            crc = crc_x25(f"{field.type} {field.name} ".encode(), crc)
            if field.length:
                crc = crc_x25(bytes([field.length]), crc)
        return (crc & 0xFF) ^ (crc >> 8)


def _floats(*names: str) -> tuple[Field, ...]:
    return tuple(Field("float", name) for name in names)


DEFINITIONS = {
    0: Definition(
        "HEARTBEAT",
        (
            Field("uint32_t", "custom_mode"),
            Field("uint8_t", "type"),
            Field("uint8_t", "autopilot"),
            Field("uint8_t", "base_mode"),
            Field("uint8_t", "system_status"),
            Field("uint8_t", "mavlink_version"),
        ),
    ),
    102: Definition(
        "VISION_POSITION_ESTIMATE",
        (Field("uint64_t", "usec"), *_floats("x", "y", "z", "roll", "pitch", "yaw")),
        (Field("float", "covariance", 21), Field("uint8_t", "reset_counter")),
    ),
    103: Definition(
        "VISION_SPEED_ESTIMATE",
        (Field("uint64_t", "usec"), *_floats("x", "y", "z")),
        (Field("float", "covariance", 9), Field("uint8_t", "reset_counter")),
    ),
    138: Definition(
        "ATT_POS_MOCAP",
        (Field("uint64_t", "time_usec"), Field("float", "q", 4), *_floats("x", "y", "z")),
        (Field("float", "covariance", 21),),
    ),
    111: Definition("TIMESYNC", (Field("int64_t", "tc1"), Field("int64_t", "ts1"))),
    331: Definition(
        "ODOMETRY",
        (
            Field("uint64_t", "time_usec"),
            *_floats("x", "y", "z"),
            Field("float", "q", 4),
            *_floats("vx", "vy", "vz", "rollspeed", "pitchspeed", "yawspeed"),
            Field("float", "pose_covariance", 21),
            Field("float", "velocity_covariance", 21),
            Field("uint8_t", "frame_id"),
            Field("uint8_t", "child_frame_id"),
        ),
        (Field("uint8_t", "reset_counter"), Field("uint8_t", "estimator_type"), Field("int8_t", "quality")),
    ),
}


@dataclass(frozen=True)
class ByHand:
    """One decoded frame."""

    name: str
    sequence: int
    system_id: int
    component_id: int
    fields: dict[str, Value]
    raw: bytes


def crc_x25(data: bytes, crc: int = 0xFFFF) -> int:
    """Return the X.25 checksum as MAVLink uses it: reflected polynomial 0x8408, start 0xFFFF, no final inversion."""
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0x8408 if crc & 1 else crc >> 1
    return crc


def parse(data: bytes) -> list[ByHand]:
    """Return the frames of `data`, which must hold whole unsigned MAVLink 2 frames and nothing else."""
    frames = []
    while data:
        length = 10 + data[1] + 2
        frames.append(_parse_one(data[:length]))
        data = data[length:]
    return frames


def whole_frames(data: bytes) -> int:
    """Return how many bytes of `data`, which starts with a frame, are whole frames."""
    at = 0
    while len(data) - at >= 12 and at + 12 + data[at + 1] <= len(data):
        at += 12 + data[at + 1]
    return at


def _parse_one(raw: bytes) -> ByHand:
    magic, length, incompatible, compatible, sequence, system, component = raw[:7]
    if magic != 0xFD or incompatible or compatible or len(raw) != 12 + length:
        raise ValueError(f"not a plain MAVLink 2 frame: {raw.hex()}")
    definition = DEFINITIONS[int.from_bytes(raw[7:10], "little")]
    expected = crc_x25(bytes([definition.seed()]), crc_x25(raw[1:-2]))
    if int.from_bytes(raw[-2:], "little") != expected:
        raise ValueError(f"{definition.name}: wrong checksum, should be {expected:#06x}")
    return ByHand(definition.name, sequence, system, component, _fields(definition, raw[10:-2]), raw)


def _fields(definition: Definition, payload: bytes) -> dict[str, Value]:
    """Decode a payload, putting back the zeros MAVLink 2 cuts from its end."""
    fields = definition.base + definition.extensions
    layout = struct.Struct("<" + "".join(f"{field.length or 1}{_FORMATS[field.type]}" for field in fields))
    values = list(layout.unpack(payload.ljust(layout.size, b"\0")))
    decoded: dict[str, Value] = {}
    for field in fields:
        decoded[field.name] = [values.pop(0) for _ in range(field.length)] if field.length else values.pop(0)
    return decoded
