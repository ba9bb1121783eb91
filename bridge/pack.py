"""Estimates to MAVLink messages."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType

from bridge.dialect import enum
from bridge.ned import NedFrame, NedState
from bridge.wire import FieldValue, Message
from tracker.types import Estimate

Fields = dict[str, FieldValue]
HEARTBEAT = "HEARTBEAT"
WORTHLESS_M = 0.1  # one sigma at which a position has no quality left

_LOCAL_FRD, _BODY_FRD = enum("MAV_FRAME_LOCAL_FRD"), enum("MAV_FRAME_BODY_FRD")
_VISION = enum("MAV_ESTIMATOR_TYPE_VISION")
_HEARTBEAT_FIELDS = MappingProxyType(
    {
        "type": enum("MAV_TYPE_ONBOARD_CONTROLLER"),
        "autopilot": enum("MAV_AUTOPILOT_INVALID"),
        "base_mode": 0,
        "custom_mode": 0,
        "system_status": enum("MAV_STATE_ACTIVE"),
        "mavlink_version": 3,
    }
)


def _vision_position(estimate: Estimate, ned: NedState) -> Fields:
    x, y, z = ned.p_BinN
    roll, pitch, yaw = ned.euler
    return {
        "usec": estimate.t_ns // 1000,
        "x": x,
        "y": y,
        "z": z,
        "roll": roll,
        "pitch": pitch,
        "yaw": yaw,
        "covariance": ned.pose_covariance,
        "reset_counter": estimate.reset_counter,
    }


def _att_pos_mocap(estimate: Estimate, ned: NedState) -> Fields:
    x, y, z = ned.p_BinN
    return {
        "time_usec": estimate.t_ns // 1000,
        "q": ned.q_FtoN,
        "x": x,
        "y": y,
        "z": z,
        "covariance": ned.pose_covariance,
    }


def _vision_speed(estimate: Estimate, ned: NedState) -> Fields:
    x, y, z = ned.v_BinN
    return {
        "usec": estimate.t_ns // 1000,
        "x": x,
        "y": y,
        "z": z,
        "covariance": ned.v_covariance,
        "reset_counter": estimate.reset_counter,
    }


def _odometry(estimate: Estimate, ned: NedState) -> Fields:
    """Fill ODOMETRY with the one pair of frames that ArduPilot takes and PX4 takes as well.

    PX4 never reads the estimator type MOCAP.  quality: 100 at no uncertainty, 1 from 10 cm of one sigma on.
    """
    x, y, z = ned.p_BinN
    vx, vy, vz = ned.v_BinF
    roll_rate, pitch_rate, yaw_rate = ned.w_BinF
    return {
        "time_usec": estimate.t_ns // 1000,
        "frame_id": _LOCAL_FRD,
        "child_frame_id": _BODY_FRD,
        "x": x,
        "y": y,
        "z": z,
        "q": ned.q_FtoN,
        "vx": vx,
        "vy": vy,
        "vz": vz,
        "rollspeed": roll_rate,
        "pitchspeed": pitch_rate,
        "yawspeed": yaw_rate,
        "pose_covariance": ned.pose_covariance,
        "velocity_covariance": ned.twist_covariance,
        "reset_counter": estimate.reset_counter,
        "estimator_type": _VISION,
        "quality": _quality(estimate),
    }


def _quality(estimate: Estimate) -> int:
    """Return MAVLink's quality 1..100 by the largest sigma of the position."""
    variance = estimate.covariance.item
    sigma_m = math.sqrt(max(variance(0, 0), variance(1, 1), variance(2, 2)))
    return max(1, round(100.0 * (1.0 - sigma_m / WORTHLESS_M)))


_FILL: Mapping[str, Callable[[Estimate, NedState], Fields]] = MappingProxyType(
    {
        "VISION_POSITION_ESTIMATE": _vision_position,
        "ATT_POS_MOCAP": _att_pos_mocap,
        "VISION_SPEED_ESTIMATE": _vision_speed,
        "ODOMETRY": _odometry,
    }
)
MESSAGES = tuple(_FILL)
"""The messages a link may be given; every link gets heartbeats besides."""


class Packer:
    """Make MAVLink messages of estimates.

    room_yaw_deg: heading of the room's x axis, clockwise from north [deg].
    """

    def __init__(self, room_yaw_deg: float) -> None:
        self._frame = NedFrame(room_yaw_deg)
        self._turned: tuple[Estimate, NedState] | None = None

    def messages(self, estimate: Estimate, names: Iterable[str]) -> dict[str, Message]:
        """Return the messages named (of `MESSAGES`) by name; the turn into NED is done once for all of them."""
        t_ns, available_ns, ned = estimate.t_ns, estimate.available_ns, self._ned(estimate)
        return {name: Message(name, t_ns, available_ns, _FILL[name](estimate, ned)) for name in names}

    def motion(self, estimate: Estimate) -> tuple[list[float], float]:
        """Return the velocity, north-east-down [m/s], and the yaw [rad]."""
        ned = self._ned(estimate)
        return ned.v_BinN, ned.euler[2]

    def _ned(self, estimate: Estimate) -> NedState:
        """Turn an estimate into NED; the newest one's turn is kept."""
        if self._turned is None or self._turned[0] is not estimate:
            self._turned = estimate, self._frame.turn(estimate)
        return self._turned[1]


def heartbeat(t_ns: int) -> Message:
    """Return the heartbeat of stream time t_ns [ns]."""
    return Message(HEARTBEAT, t_ns, 0, _HEARTBEAT_FIELDS)
