"""The simulated autopilot's idea of where it is, made of the poses it receives and nothing else.

It treats external vision as ArduPilot does: its own clock is set to the sender's by the least (arrival - stamp) of the
last messages, samples less than 20 ms apart are dropped, a changed reset_counter re-aligns the position, and 300 ms of
silence are ill health. Frames: N north-east-down, F forward-right-down.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bridge.wire import FieldValue, Received
from tracker import so3
from tracker.types import Array

GRAVITY = 9.80665
SILENCE_NS = 300_000_000
SPACING_NS = 20_000_000
_CLOCK_MESSAGES = 100
_ALPHA = 0.70
_BETA = _ALPHA**2 / (2.0 - _ALPHA)  # critically damped, Benedict and Bordner (1962)
_MAX_GAP_S = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class VisionPose:
    """One received pose. usec: the sender's stamp.  p_BinN: (3,) [m].  euler: roll, pitch, yaw of F in N [rad]."""

    usec: int
    p_BinN: Array
    euler: tuple[float, float, float]
    reset_counter: int


@dataclass(frozen=True, slots=True, eq=False)
class NavState:
    """Where the vehicle is now, by its own reckoning: p_BinN, v_BinN (3,) [m], [m/s], and its last attitude [rad]."""

    p_BinN: Array
    v_BinN: Array
    euler: tuple[float, float, float]


def vision_pose(message: Received) -> VisionPose | None:
    """Read a pose from a message; None if it holds none."""
    fields = message.fields
    if message.message == "VISION_POSITION_ESTIMATE":
        euler = (_number(fields, "roll"), _number(fields, "pitch"), _number(fields, "yaw"))
        return VisionPose(int(_number(fields, "usec")), _position(fields), euler, int(_number(fields, "reset_counter")))
    if message.message == "ATT_POS_MOCAP":
        # It has no reset_counter: like ArduPilot, take it as 0.
        return VisionPose(int(_number(fields, "time_usec")), _position(fields), _euler(fields["q"]), 0)
    return None


class Navigation:
    """Follow position and velocity by an alpha-beta filter over the stamps of the poses.

    delay_ns: the least time from mid-exposure to arrival, as an operator sets VISO_DELAY_MS; the clock cannot learn it.
    drag_1_s: loss of level speed per second, to know the acceleration from the tilt.
    """

    def __init__(self, delay_ns: int, drag_1_s: float) -> None:
        self._delay_ns = delay_ns
        self._drag_1_s = drag_1_s
        self._ahead_ns: deque[int] = deque(maxlen=_CLOCK_MESSAGES)
        self._pose: VisionPose | None = None
        self._p: Array = np.zeros(3)
        self._v: Array = np.zeros(3)
        self._arrived_ns: int | None = None
        self.accepted = 0
        self.dropped = 0
        self.resets = 0

    def take(self, pose: VisionPose, now_ns: int) -> None:
        """Take a pose that arrived at now_ns of the own clock."""
        if self._pose is not None and abs(pose.usec - self._pose.usec) * 1000 < SPACING_NS:
            self.dropped += 1
            return
        if self._pose is not None and pose.usec < self._pose.usec:
            self.dropped += 1
            return
        self._ahead_ns.append(now_ns - pose.usec * 1000)
        self._filter(pose)
        self._pose = pose
        self._arrived_ns = now_ns
        self.accepted += 1

    def healthy(self, now_ns: int) -> bool:
        """Say whether a pose came within the last 300 ms."""
        return self._arrived_ns is not None and now_ns - self._arrived_ns <= SILENCE_NS

    def state_at(self, now_ns: int) -> NavState | None:
        """Return the state carried on from the last pose's stamp to now; None before the first pose."""
        if self._pose is None:
            return None
        stamped_ns = self._pose.usec * 1000 + min(self._ahead_ns) - self._delay_ns
        age_s = min(max((now_ns - stamped_ns) / 1e9, 0.0), _MAX_GAP_S)
        a = self._acceleration(self._pose)
        return NavState(self._p + (self._v + 0.5 * age_s * a) * age_s, self._v + age_s * a, self._pose.euler)

    def _filter(self, pose: VisionPose) -> None:
        last = self._pose
        if last is None or (pose.usec - last.usec) / 1e6 > _MAX_GAP_S:
            self._p, self._v = pose.p_BinN, np.zeros(3)
            return
        if pose.reset_counter != last.reset_counter:
            self.resets += 1
            self._p = pose.p_BinN  # where it was is void, how it moves is not
            return
        dt_s = (pose.usec - last.usec) / 1e6
        a = self._acceleration(last)
        p, v = self._p + (self._v + 0.5 * dt_s * a) * dt_s, self._v + dt_s * a
        innovation = pose.p_BinN - p
        self._p, self._v = p + _ALPHA * innovation, v + _BETA / dt_s * innovation

    def _acceleration(self, pose: VisionPose) -> Array:
        """Return the level acceleration (3,) in N that the tilt gives: lift along -z_F, less the drag."""
        down_inN = so3.from_euler(*pose.euler)[:, 2]
        a = -GRAVITY * down_inN - self._drag_1_s * self._v
        a[2] = 0.0  # the lift is not known, so neither is the climb's change
        return np.asarray(a)


def _number(fields: Mapping[str, FieldValue], name: str) -> float:
    value = fields[name]
    return float(value) if isinstance(value, int | float) else math.nan


def _position(fields: Mapping[str, FieldValue]) -> Array:
    return np.array([_number(fields, axis) for axis in "xyz"])


def _euler(q: FieldValue) -> tuple[float, float, float]:
    """Return roll, pitch, yaw of a quaternion w x y z."""
    w, x, y, z = np.asarray(q, dtype=np.float64).tolist()
    R = np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )
    return so3.to_euler(R)
