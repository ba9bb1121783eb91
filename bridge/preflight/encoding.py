"""Numbers in PARAM_VALUE and PARAM_SET: ArduPilot casts them to a float, PX4 puts their bytes where the float goes."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from types import MappingProxyType

from bridge.wire import Received
from tracker.errors import OperatorError

REAL32 = 9
INT32 = 6
MAVLINK_2 = 0xFD
_FLOAT = struct.Struct("<f")
# MAV_PARAM_TYPE of common.xml, those of four bytes and fewer: nothing longer fits the field.
_LAYOUTS: Mapping[int, struct.Struct] = MappingProxyType(
    {
        1: struct.Struct("<Bxxx"),
        2: struct.Struct("<bxxx"),
        3: struct.Struct("<Hxx"),
        4: struct.Struct("<hxx"),
        5: struct.Struct("<I"),
        INT32: struct.Struct("<i"),
        REAL32: _FLOAT,
    }
)


def value_of(received: Received, bytewise: bool) -> float:
    """Return the number that a PARAM_VALUE carries.

    The four bytes are taken from the frame itself: as a float, an integer's bytes may be a NaN, whose bits a host may
    change.

    Args:
        bytewise: PX4's encoding, else ArduPilot's.
    Source: https://mavlink.io/en/services/parameter.html, "Parameter encoding". param_value is the payload's first
        field, for fields go by size; the header has 10 bytes in MAVLink 2 and 6 in MAVLink 1.
    """
    kind = int(str(received.fields["param_type"]))
    start = 10 if received.raw[0] == MAVLINK_2 else 6
    layout = _LAYOUTS.get(kind, _FLOAT) if bytewise else _FLOAT
    return float(layout.unpack(received.raw[start : start + 4])[0])


def field_of(value: float, kind: int, bytewise: bool) -> float:
    """Return what PARAM_SET's float field must hold for a number of a kind.

    Raises:
        OperatorError: a number that the kind cannot hold.
    """
    layout = _LAYOUTS.get(kind, _FLOAT) if bytewise else _FLOAT
    try:
        packed = layout.pack(value if layout is _FLOAT else _whole(value))
    except (struct.error, OverflowError, ValueError) as error:
        raise OperatorError(f"parameter value {value:g}: its type {kind} cannot hold it; give another") from error
    return float(_FLOAT.unpack(packed)[0])


def same(one: float, other: float) -> bool:
    """Say whether two numbers are the same float of 32 bits."""
    return _FLOAT.pack(one) == _FLOAT.pack(other)


def _whole(value: float) -> int:
    if value != int(value):
        raise ValueError(f"{value:g} is not a whole number")
    return int(value)
