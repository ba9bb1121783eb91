"""External vision as ArduPilot takes it: which messages count, what becomes of stamps, covariances and counters.

Source: ArduPilot's AP_VisualOdom, GCS_Common.cpp and NavEKF3's writeExtNavData, as of 4.8 development.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bridge.wire import FieldValue, Received
from tools.simulate.autopilot.jitter import JitterCorrection
from tools.simulate.autopilot.parameters import Parameters
from tracker.maths import so3
from tracker.types import Array

SILENCE_MS = 300
SPACING_MS = 20
_FRD = (20, 12)
"""MAV_FRAME_LOCAL_FRD and MAV_FRAME_BODY_FRD: ODOMETRY in any other pair of frames is passed over in silence."""
_MOST_SIGMA_M, _MOST_SIGMA_RAD, _MOST_SIGMA_M_S = 100.0, 1.5, 5.0
_UINT32 = 1 << 32


@dataclass(frozen=True, slots=True, eq=False)
class PoseSample:
    """A pose for the filter. t_ms: autopilot's time, delay taken off.  sigma_m, sigma_rad: floored by VISO_*_M_NSE."""

    t_ms: int
    p_BinN: Array
    yaw: float
    sigma_m: float
    sigma_rad: float
    reset: bool


@dataclass(frozen=True, slots=True, eq=False)
class SpeedSample:
    """A velocity for the filter, v_BinN (3,) [m/s]; sigma_m_s: floored by VISO_VEL_M_NSE."""

    t_ms: int
    v_BinN: Array
    sigma_m_s: float


@dataclass(frozen=True, slots=True, eq=False)
class _Pose:
    """A pose as a message brought it."""

    p_BinN: Array
    R_FtoN: Array
    covariance: list[float]
    reset_counter: int
    quality: int = 0


class VisionSensor:
    """Turn messages into samples for the filter.

    What counts is the message, not its component: any of the own system id's may send vision.
    met_nan: whether a variance was not a number, beside the first one; ArduPilot takes that for an error of its own.
    """

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._reset_counter = 0
        self._reset_ms = 0
        self._seen_reset_ms = 0
        self._pose_ms: int | None = None
        self._speed_ms: int | None = None
        self._arrived_ms: int | None = None
        self.accepted = 0
        self.dropped = 0
        self.resets = 0
        self.met_nan = False

    def take(
        self, message: Received, arrived_us: int, clock: JitterCorrection, filter_runs: bool
    ) -> tuple[PoseSample | SpeedSample, ...]:
        """Take a message; return what the filter gets of it.

        Args:
            message: any.
            arrived_us: when it arrived, by the own clock [us].
            clock: the link's correction of stamps; every vision message teaches it.
            filter_runs: false until the filter is initialised: it takes nothing before.
        """
        stamp_us = message.fields.get("usec", message.fields.get("time_usec"))
        pose, speed = _pose(message), _speed(message)
        if (pose is None and speed is None) or not isinstance(stamp_us, int) or self._parameters["VISO_TYPE"] != 1:
            return ()
        t_ms = clock.corrected_us(stamp_us, arrived_us) // 1000
        self._arrived_ms = arrived_us // 1000
        samples: list[PoseSample | SpeedSample] = []
        if pose is not None:
            samples += self._pose_sample(pose, t_ms, filter_runs)
        if speed is not None:
            samples += self._speed_sample(*speed, t_ms, filter_runs)
        return tuple(samples)

    def healthy(self, now_ms: int) -> bool:
        """Say whether a message came within the last 300 ms, whatever became of it."""
        return self._arrived_ms is not None and now_ms - self._arrived_ms < SILENCE_MS

    def _pose_sample(self, pose: _Pose, t_ms: int, filter_runs: bool) -> list[PoseSample | SpeedSample]:
        sigma_m, sigma_rad = _sigma(pose.covariance, (0, 6, 11)), _sigma(pose.covariance, (15, 18, 20))
        self.met_nan |= math.isnan(sigma_m + sigma_rad)
        if pose.quality < self._parameters["VISO_QUAL_MIN"]:
            return []
        if pose.reset_counter != self._reset_counter:  # any change, up or down, within a message type or between two
            self._reset_counter, self._reset_ms = pose.reset_counter, self._arrived_ms or 0
        if not np.isfinite(pose.p_BinN).all():
            return []
        if not filter_runs or _too_soon(t_ms, self._pose_ms):
            self.dropped += 1
            return []
        self._pose_ms = t_ms
        reset = self._reset_ms != self._seen_reset_ms
        self._seen_reset_ms = self._reset_ms
        self.resets += reset
        self.accepted += 1
        return [
            PoseSample(
                t_ms - round(self._parameters["VISO_DELAY_MS"]),
                pose.p_BinN,
                so3.to_euler(pose.R_FtoN)[2],
                _within(sigma_m, self._parameters["VISO_POS_M_NSE"], _MOST_SIGMA_M),
                _within(sigma_rad, self._parameters["VISO_YAW_M_NSE"], _MOST_SIGMA_RAD),
                reset,
            )
        ]

    def _speed_sample(
        self, v_BinN: Array, sigma: float, quality: int, t_ms: int, filter_runs: bool
    ) -> list[PoseSample | SpeedSample]:
        if quality < self._parameters["VISO_QUAL_MIN"] or not np.isfinite(v_BinN).all():
            return []
        if not filter_runs or _too_soon(t_ms, self._speed_ms):
            return []
        self._speed_ms = t_ms
        floor = self._parameters["VISO_VEL_M_NSE"]
        return [
            SpeedSample(t_ms - round(self._parameters["VISO_DELAY_MS"]), v_BinN, _within(sigma, floor, _MOST_SIGMA_M_S))
        ]


def _too_soon(t_ms: int, last_ms: int | None) -> bool:
    """Say whether a sample is less than 20 ms after the last.

    The difference is unsigned as in NavEKF3: a stamp that goes back wraps round to something huge, and is taken.
    """
    return last_ms is not None and (t_ms - last_ms) % _UINT32 < SPACING_MS


def _pose(message: Received) -> _Pose | None:
    fields = message.fields
    match message.message:
        case "VISION_POSITION_ESTIMATE":
            R_FtoN = so3.from_euler(*(_number(fields, name) for name in ("roll", "pitch", "yaw")))
            return _Pose(_vector(fields, "xyz"), R_FtoN, _list(fields, "covariance"), _count(fields))
        case "ATT_POS_MOCAP":  # it has no reset_counter: that counts as 0
            return _Pose(_vector(fields, "xyz"), _rotation(fields["q"]), _list(fields, "covariance"), 0)
        case "ODOMETRY" if _frames(fields) == _FRD:
            return _Pose(
                _vector(fields, "xyz"),
                _rotation(fields["q"]),
                _list(fields, "pose_covariance"),
                _count(fields),
                round(_number(fields, "quality")),
            )
        case _:
            return None


def _speed(message: Received) -> tuple[Array, float, int] | None:
    """Return v_BinN [m/s], one sigma [m/s] and the quality; None if the message holds none."""
    fields = message.fields
    if message.message == "VISION_SPEED_ESTIMATE":
        return _vector(fields, "xyz"), _sigma(_list(fields, "covariance"), (0, 4, 8)), 0
    if message.message == "ODOMETRY" and _frames(fields) == _FRD:
        v_BinF = np.array([_number(fields, name) for name in ("vx", "vy", "vz")])
        return _rotation(fields["q"]) @ v_BinF, 0.0, round(_number(fields, "quality"))
    return None


def _sigma(covariance: list[float], places: tuple[int, int, int]) -> float:
    """Return the root of the sum of three variances, as ArduPilot takes it; 0 where the first of all is not a number.

    Where only another is none, or the sum is negative, neither is the root. 4.7 takes the cube root of the sum of
    squares instead, which comes to the same below the floor.
    """
    total = sum(covariance[place] for place in places)
    if math.isnan(covariance[0]):
        return 0.0
    return math.sqrt(total) if total >= 0.0 else math.nan


def _within(sigma: float, least: float, most: float) -> float:
    """Return sigma between its limits; their middle where it is not a number, as `constrain_float` has it."""
    return (least + most) / 2.0 if math.isnan(sigma) else min(max(sigma, least), most)


def _frames(fields: Mapping[str, FieldValue]) -> tuple[FieldValue, FieldValue]:
    return fields["frame_id"], fields["child_frame_id"]


def _count(fields: Mapping[str, FieldValue]) -> int:
    return int(_number(fields, "reset_counter"))


def _number(fields: Mapping[str, FieldValue], name: str) -> float:
    value = fields[name]
    return float(value) if isinstance(value, int | float) else math.nan


def _list(fields: Mapping[str, FieldValue], name: str) -> list[float]:
    value = fields[name]
    return [float(each) for each in value] if isinstance(value, list) else []


def _vector(fields: Mapping[str, FieldValue], names: str) -> Array:
    return np.array([_number(fields, name) for name in names])


def _rotation(q: FieldValue) -> Array:
    """Return the rotation matrix of a quaternion w x y z."""
    w, x, y, z = np.asarray(q, dtype=np.float64).tolist()
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )
