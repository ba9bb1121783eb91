"""What becomes a column: of an estimate, and of each message of the autopilot's that identification needs.

A group is what comes in one record: its columns share their times. Units are in the names; autopilot's columns start
with `ap_` and are in its own frames: north, east, down (N), and forward, right, down in the body (FRD).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scipy.spatial.transform import Rotation

from bridge.log import topics, triangle
from tools.export.resample import Layout
from tracker.types import TrackState

RECEIVED_PREFIX = "/mavlink/received/"
G_M_S2 = 9.80665
UINT16_UNKNOWN, INT16_UNKNOWN = 65535, -1
ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED
_AXES = ("x", "y", "z")
_RATES = ("rollspeed", "pitchspeed", "yawspeed")
STATES = tuple(state.value for state in TrackState)

Row = list[float]
Reader = Callable[[Mapping[str, Any]], Row]


@dataclass(frozen=True, slots=True)
class Group:
    """One kind of record. names: its columns.  layout: of them.  read: makes a row of a record's value."""

    name: str
    names: tuple[str, ...]
    layout: Layout
    read: Reader


ESTIMATE_NAMES = (
    *(f"{axis}_m" for axis in _AXES),
    *(f"q{axis}" for axis in ("w", *_AXES)),
    *(f"v{axis}_m_s" for axis in _AXES),
    *(f"w{axis}_rad_s" for axis in _AXES),
    *(f"sd_{axis}_m" for axis in _AXES),
    *(f"sd_theta_{axis}_rad" for axis in _AXES),
    *(f"sd_v{axis}_m_s" for axis in _AXES),
    *(f"sd_w{axis}_rad_s" for axis in _AXES),
    "state",
    "reset_counter",
    "nis",
    "nis_dof",
)
_HELD_FROM = ESTIMATE_NAMES.index("state")
RESET_COLUMN = ESTIMATE_NAMES.index("reset_counter")


def estimate_row(value: Mapping[str, Any]) -> Row:
    """Return the numbers of an `/estimate` message in the order of ESTIMATE_NAMES; the state as its place in STATES."""
    motion = (value[key] for key in ("p_BinW_m", "q_BtoW", "v_BinW_m_s", "w_BinB_rad_s"))
    covariance = value["covariance"]
    state = STATES.index(value["state"]) if value["state"] in STATES else math.nan
    return [
        *(_number(one) for values in motion for one in values),
        *(_deviation(covariance[i]) for i in triangle.DIAGONAL),
        state,
        value["reset_counter"],
        _number(value["nis"]),
        value["nis_dof"],
    ]


ESTIMATES = Group(
    topics.ESTIMATE.name,
    ESTIMATE_NAMES,
    Layout(quaternion=3, held=tuple(range(_HELD_FROM, len(ESTIMATE_NAMES)))),
    estimate_row,
)


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float) else math.nan


def _deviation(variance: float | None) -> float:
    return math.nan if variance is None or variance < 0 else math.sqrt(variance)


def _plain(message: str, columns: Sequence[tuple[str, str, float]], unknown: tuple[int, ...] = ()) -> Group:
    """Make a group of fields: each with its column's name and factor; some whole numbers mean that it is not known."""

    def read(value: Mapping[str, Any]) -> Row:
        fields = value["fields"]
        found = (fields.get(field) for field, _, _ in columns)
        return [
            math.nan if one in unknown else _number(one) * factor
            for one, (_, _, factor) in zip(found, columns, strict=True)
        ]

    return Group(RECEIVED_PREFIX + message, tuple(name for _, name, _ in columns), Layout(), read)


def _attitude(value: Mapping[str, Any]) -> Row:
    """Return ATTITUDE as the quaternion FRD to N, w x y z, and its rates. Angles are no numbers to average."""
    fields = value["fields"]
    angles = [_number(fields.get(name)) for name in ("yaw", "pitch", "roll")]
    if not all(math.isfinite(angle) for angle in angles):
        return [math.nan] * 7
    q = Rotation.from_euler("ZYX", angles).as_quat(scalar_first=True).tolist()
    return [*q, *(_number(fields.get(name)) for name in _RATES)]


def _battery(value: Mapping[str, Any]) -> Row:
    fields = value["fields"]
    cells = [cell for cell in fields.get("voltages", ()) if cell != UINT16_UNKNOWN]
    current = fields.get("current_battery", -1)
    return [sum(cells) * 1e-3 if cells else math.nan, math.nan if current == -1 else current * 1e-2]


def _heartbeat(value: Mapping[str, Any]) -> Row:
    fields = value["fields"]
    mode, armed = fields.get("custom_mode"), fields.get("base_mode")
    return [_number(mode), float(bool(armed & ARMED)) if isinstance(armed, int) else math.nan]


def _imu(message: str, acceleration: float, rate: float, prefix: str) -> Group:
    """Make the group of an inertial unit, whose fields have these units [m/s^2] and [rad/s]."""
    columns = [(f"{axis}acc", f"{prefix}a{axis}_FRD_m_s2", acceleration) for axis in _AXES]
    columns += [(f"{axis}gyro", f"{prefix}w{axis}_FRD_rad_s", rate) for axis in _AXES]
    return _plain(message, columns)


_UNUSED = (0, UINT16_UNKNOWN)  # a servo or radio channel that is not there
GROUPS: Mapping[str, Group] = {
    group.name: group
    for group in (
        ESTIMATES,
        _plain("SERVO_OUTPUT_RAW", [(f"servo{n}_raw", f"ap_servo{n}_us", 1.0) for n in range(1, 17)], _UNUSED),
        _plain("RC_CHANNELS", [(f"chan{n}_raw", f"ap_rc{n}_us", 1.0) for n in range(1, 19)], _UNUSED),
        Group(
            RECEIVED_PREFIX + "ATTITUDE",
            ("ap_qw", "ap_qx", "ap_qy", "ap_qz", *(f"ap_{name}_rad_s" for name in _RATES)),
            Layout(quaternion=0),
            _attitude,
        ),
        _plain(
            "LOCAL_POSITION_NED",
            [
                (field, f"ap_{name}", 1.0)
                for field, name in (
                    ("x", "north_m"), ("y", "east_m"), ("z", "down_m"),
                    ("vx", "vnorth_m_s"), ("vy", "veast_m_s"), ("vz", "vdown_m_s"),
                )
            ],
        ),
        # ArduPilot and the common practice fill RAW_IMU with milli-g and milliradians, whatever MAVLink says of "raw".
        _imu("RAW_IMU", G_M_S2 * 1e-3, 1e-3, "ap_raw_"),
        _imu("SCALED_IMU", G_M_S2 * 1e-3, 1e-3, "ap_imu1_"),
        _imu("SCALED_IMU2", G_M_S2 * 1e-3, 1e-3, "ap_imu2_"),
        _imu("SCALED_IMU3", G_M_S2 * 1e-3, 1e-3, "ap_imu3_"),
        _imu("HIGHRES_IMU", 1.0, 1.0, "ap_imu_"),
        Group(RECEIVED_PREFIX + "BATTERY_STATUS", ("ap_battery_V", "ap_battery_A"), Layout(), _battery),
        Group(RECEIVED_PREFIX + "HEARTBEAT", ("ap_custom_mode", "ap_armed"), Layout(held=(0, 1)), _heartbeat),
    )
}  # fmt: skip
