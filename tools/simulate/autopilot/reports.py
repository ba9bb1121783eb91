"""What the autopilot tells of itself: its telemetry messages."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from bridge.dialect import enum, make_message
from bridge.wire import FieldValue, Message
from tools.simulate.autopilot.imu import Increment
from tools.simulate.autopilot.navigation import Navigation, NavState
from tools.simulate.autopilot.origins import Origin
from tools.simulate.control import PilotSticks
from tools.simulate.dynamics import GRAVITY

Fields = dict[str, FieldValue]
GUIDED, LAND = 4, 9
"""ArduCopter's custom_mode numbers."""

VERSION = (4, 7, 0)
_OFFICIAL = 255
_METRES_PER_1E7_DEG = 0.011131884502145034
_MAX_INT16 = 32767


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """The autopilot at one instant.

    now_ns: since its boot.  mode: custom_mode.  state: None without a position.  sticks: the last ones it flew by.
    """

    now_ns: int
    armed: bool
    mode: int
    navigation: Navigation
    state: NavState | None
    increment: Increment
    sticks: PilotSticks

    @property
    def now_ms(self) -> int:
        """Return the time since boot [ms]."""
        return self.now_ns // 1_000_000


def report(name: str, now: Snapshot) -> Message | None:
    """Return a telemetry message by name; None where it does not exist or has nothing to tell."""
    if name not in _FILL:
        return None
    fields = _FILL[name](now)
    return None if fields is None else make_message(name, now.now_ns, **fields)


def _heartbeat(now: Snapshot) -> Fields:
    mode = enum("MAV_MODE_FLAG_CUSTOM_MODE_ENABLED") | enum("MAV_MODE_FLAG_STABILIZE_ENABLED")
    return {
        "type": enum("MAV_TYPE_HELICOPTER"),
        "autopilot": enum("MAV_AUTOPILOT_ARDUPILOTMEGA"),
        "base_mode": mode | (enum("MAV_MODE_FLAG_SAFETY_ARMED") if now.armed else 0),
        "custom_mode": now.mode,
        "system_status": enum("MAV_STATE_ACTIVE" if now.armed else "MAV_STATE_STANDBY"),
        "mavlink_version": 3,
    }


def _timesync(now: Snapshot) -> Fields:
    return {"tc1": 0, "ts1": now.now_ns}


def _attitude(now: Snapshot) -> Fields | None:
    if now.state is None:
        return None
    roll, pitch, yaw = now.state.euler
    p, q, r = now.state.w_BinF.tolist()
    time: Fields = {"time_boot_ms": now.now_ms}
    return time | {"roll": roll, "pitch": pitch, "yaw": yaw, "rollspeed": p, "pitchspeed": q, "yawspeed": r}


def _local_position(now: Snapshot) -> Fields | None:
    if now.state is None:
        return None
    x, y, z = now.state.p_BinN.tolist()
    vx, vy, vz = now.state.v_BinN.tolist()
    return {"time_boot_ms": now.now_ms, "x": x, "y": y, "z": z, "vx": vx, "vy": vy, "vz": vz}


def _global_position(now: Snapshot) -> Fields:
    """Latitude and longitude stay 0 while the filter has no origin, whatever GPS_GLOBAL_ORIGIN says."""
    origin, state = now.navigation.origin, now.state
    if origin is None or state is None:
        return {"time_boot_ms": now.now_ms}
    n, e, d = state.p_BinN.tolist()
    vx, vy, vz = (round(100 * v) for v in state.v_BinN.tolist())
    east_scale = _METRES_PER_1E7_DEG * math.cos(math.radians(origin.latitude * 1e-7))
    return {
        "time_boot_ms": now.now_ms,
        "lat": origin.latitude + round(n / _METRES_PER_1E7_DEG),
        "lon": origin.longitude + round(e / east_scale),
        "alt": origin.altitude_mm - round(1000 * d),
        "relative_alt": -round(1000 * d),
        "vx": vx,
        "vy": vy,
        "vz": vz,
        "hdg": round(math.degrees(state.euler[2]) % 360.0 * 100) % 36000,
    }


def _ekf_status(now: Snapshot) -> Fields:
    variances = now.navigation.variances
    return {
        "flags": now.navigation.flags(),
        "velocity_variance": variances.velocity,
        "pos_horiz_variance": variances.position,
        "pos_vert_variance": variances.height,
        "compass_variance": variances.compass,
    }


def _inertial(now: Snapshot) -> Fields:
    """Readings as they are, biases and all: milli-g and milli-rad/s."""
    dt_s = now.increment.dt_s
    accel = [_int16(1000.0 * a / dt_s / GRAVITY) for a in now.increment.speed_inF.tolist()]
    gyro = [_int16(1000.0 * w / dt_s) for w in now.increment.turn_inF.tolist()]
    names = ("xacc", "yacc", "zacc", "xgyro", "ygyro", "zgyro")
    return dict(zip(names, accel + gyro, strict=True))


def _scaled_imu(now: Snapshot) -> Fields:
    return {"time_boot_ms": now.now_ms, **_inertial(now)}


def _raw_imu(now: Snapshot) -> Fields:
    return {"time_usec": now.now_ns // 1000, **_inertial(now)}


def _servos(now: Snapshot) -> Fields:
    """Roll, pitch, climb and yaw as pulse lengths, 1000 to 2000 us; MAVLink gives their time 32 bits."""
    given = now.sticks
    sticks = (given.right, given.nose_up, given.up, given.nose_right)
    pulses: Fields = {f"servo{k}_raw": round(1500 + 500 * stick) for k, stick in enumerate(sticks, 1)}
    return {"time_usec": now.now_ns // 1000 % 2**32, **pulses}


def _radio(now: Snapshot) -> Fields:
    """Nobody holds a transmitter: no channel is there."""
    return {"time_boot_ms": now.now_ms, "rssi": 255}


def _battery(_now: Snapshot) -> None:
    """Without a battery monitor the message is known and never sent."""


def _origin(now: Snapshot) -> Fields | None:
    origin = now.navigation.answered_origin
    return None if origin is None else _origin_fields(origin, now.now_ns)


def _origin_fields(origin: Origin, now_ns: int) -> Fields:
    place: Fields = {"latitude": origin.latitude, "longitude": origin.longitude, "altitude": origin.altitude_mm}
    return place | {"time_usec": now_ns // 1000}


def _version(_now: Snapshot) -> Fields:
    major, minor, patch = VERSION
    return {
        "capabilities": enum("MAV_PROTOCOL_CAPABILITY_MAVLINK2") | enum("MAV_PROTOCOL_CAPABILITY_COMMAND_INT"),
        "flight_sw_version": major << 24 | minor << 16 | patch << 8 | _OFFICIAL,
    }


def _int16(value: float) -> int:
    return max(-_MAX_INT16, min(_MAX_INT16, round(value)))


_FILL: Mapping[str, Callable[[Snapshot], Fields | None]] = MappingProxyType(
    {
        "HEARTBEAT": _heartbeat,
        "TIMESYNC": _timesync,
        "ATTITUDE": _attitude,
        "LOCAL_POSITION_NED": _local_position,
        "GLOBAL_POSITION_INT": _global_position,
        "EKF_STATUS_REPORT": _ekf_status,
        "SCALED_IMU": _scaled_imu,
        "RAW_IMU": _raw_imu,
        "SERVO_OUTPUT_RAW": _servos,
        "RC_CHANNELS": _radio,
        "BATTERY_STATUS": _battery,
        "GPS_GLOBAL_ORIGIN": _origin,
        "AUTOPILOT_VERSION": _version,
    }
)
NUMBERS: Mapping[int, str] = MappingProxyType({enum(f"MAVLINK_MSG_ID_{name}"): name for name in _FILL})
"""Message ids of what it can tell."""
