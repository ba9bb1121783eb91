"""Where the autopilot believes to be: its filter at a delayed horizon, with EKF3's gates, time-outs and start.

Source: ArduPilot's AP_NavEKF3 as of 4.8 development, one core, external vision and IMU only; times as
measured in its SITL.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from tools.simulate.autopilot import ekf
from tools.simulate.autopilot.imu import Increment
from tools.simulate.autopilot.parameters import Parameters
from tools.simulate.autopilot.vision import PoseSample, SpeedSample
from tracker import so3
from tracker.types import Array

CORES_MS, INITIALISED_MS, ALIGNED_MS = 3300, 4200, 5400
"""Times after boot: the filter has memory; it runs; it is level."""

_EXTERNAL = 6
_HORIZON_MS = 220
_GATE, _YAW_GATE = 5.0, 3.0
_LEAST_YAW_SIGMA = math.radians(5.0)
_RETRY_WITH_SPEED_MS, _RETRY_MS, _HEIGHT_RETRY_MS, _DEAD_RECKONING_MS = 10_000, 7_000, 5_000, 1_000


@dataclass(frozen=True, slots=True, eq=False)
class NavState:
    """Where the vehicle is now, by its own reckoning.

    p_BinN, v_BinN: (3,) [m], [m/s].  euler: roll, pitch, yaw of F in N [rad].  w_BinF: (3,) [rad/s].
    """

    p_BinN: Array
    v_BinN: Array
    euler: tuple[float, float, float]
    w_BinF: Array


@dataclass(frozen=True, slots=True)
class Variances:
    """EKF_STATUS_REPORT's test ratios: 1 is a measurement at its gate; `compass` is the heading's."""

    velocity: float = 0.0
    position: float = 0.0
    height: float = 0.0
    compass: float = 0.0


@dataclass(frozen=True, slots=True)
class Origin:
    """Where N's origin lies: 1e-7 deg and mm, as on the wire."""

    latitude: int
    longitude: int
    altitude_mm: int


class Navigation:
    """The filter with its buffer of IMU readings: samples are fused when their own time has come."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._buffer: deque[tuple[int, Increment]] = deque()
        self._samples: list[PoseSample | SpeedSample] = []
        self._state: ekf.FilterState | None = None
        self._passed_ms = {"position": 0, "height": 0, "velocity": 0}
        self._now_ms = 0
        self._origin_promised: Origin | None = None
        self.origin: Origin | None = None
        self.texts: list[str] = []
        self.variances = Variances()
        self.shift_inN: Array = np.zeros(3)
        """Sum of the jumps that resets made: what a target held in N moves along with [m]."""

    @property
    def runs(self) -> bool:
        """Say whether the filter is initialised."""
        return self._now_ms >= INITIALISED_MS

    @property
    def aided(self) -> bool:
        """Say whether position is known."""
        return self._state is not None

    def set_origin(self, origin: Origin) -> bool:
        """Set the origin; say whether it is acknowledged.

        Between `CORES_MS` and `INITIALISED_MS` it is acknowledged and lost, and every later one refused: ArduPilot
        remembers there that it has one, and the start of its cores forgets which.
        """
        nothing = origin.latitude == 0 and origin.longitude == 0
        if nothing or self._now_ms < CORES_MS or self._origin_promised is not None:
            return False
        self._origin_promised = origin
        self.texts.append("EKF3 IMU0 origin set")
        if self.runs:
            self.origin = origin
        return True

    @property
    def answered_origin(self) -> Origin | None:
        """Return the origin it says it has."""
        return self._origin_promised

    def take(self, samples: tuple[PoseSample | SpeedSample, ...]) -> None:
        """Take what vision brings."""
        self._samples += samples

    def advance(self, now_ms: int, increment: Increment) -> None:
        """Go on to now_ms with what the IMU summed up since the last call."""
        self._tell_of_start(now_ms)
        self._now_ms = now_ms
        self._buffer.append((now_ms, increment))
        if self._state is None:
            self._start()
            return
        while self._buffer and self._buffer[0][0] <= now_ms - _HORIZON_MS:
            t_ms, oldest = self._buffer.popleft()
            self._state = ekf.predicted(self._state, oldest)
            self._fuse_until(t_ms)
        self._check_aiding()

    def state_now(self) -> NavState | None:
        """Return the state carried from the horizon to now by the IMU; None while position is not known."""
        if self._state is None:
            return None
        state = self._state
        for _, increment in self._buffer:
            state = ekf.carried(state, increment)
        last = self._buffer[-1][1] if self._buffer else None
        w_BinF = np.zeros(3) if last is None else last.turn_inF / last.dt_s - state.gyro_bias
        return NavState(state.p_BinN, state.v_BinN, so3.to_euler(state.R_FtoN), w_BinF)

    def flags(self) -> int:
        """Return EKF_STATUS_FLAGS: 0x400 until it runs, 0xa7 without position, 0x33f with it, an origin or none."""
        if not self.runs:
            return 0x400
        if self._now_ms < ALIGNED_MS:
            return 0
        return 0x33F if self.aided else 0xA7

    def _tell_of_start(self, now_ms: int) -> None:
        for at_ms, text in (
            (INITIALISED_MS, "EKF3 IMU0 initialised"),
            (INITIALISED_MS, "AHRS: EKF3 active"),
            (ALIGNED_MS, "EKF3 IMU0 tilt alignment complete"),
        ):
            if self._now_ms < at_ms <= now_ms:
                self.texts.append(text)

    def _start(self) -> None:
        """Start from the newest pose, once level."""
        uses = [self._parameters[name] == _EXTERNAL for name in ("EK3_SRC1_POSXY", "EK3_SRC1_YAW")]
        pose = next((each for each in reversed(self._samples) if isinstance(each, PoseSample)), None)
        if self._now_ms < ALIGNED_MS or pose is None or not all(uses):
            self._samples = self._samples[-4:]
            while self._buffer and self._buffer[0][0] <= self._now_ms - _HORIZON_MS:
                self._buffer.popleft()
            return
        self._state = ekf.started(pose.p_BinN, ekf.levelled(self._buffer[-1][1].speed_inF, pose.yaw))
        self._buffer.clear()
        self._samples.clear()
        self._passed_ms = dict.fromkeys(self._passed_ms, self._now_ms)
        n, e, d = pose.p_BinN.tolist()
        self.texts += [
            "EKF3 IMU0 yaw aligned",
            "EKF3 IMU0 is using external nav data",
            f"EKF3 IMU0 initial pos NED = {n:.1f},{e:.1f},{d:.1f} (m)",
        ]

    def _fuse_until(self, t_ms: int) -> None:
        """Fuse the samples whose time has come; those older than the horizon count as of the horizon."""
        due = [sample for sample in self._samples if sample.t_ms <= t_ms]
        self._samples = [sample for sample in self._samples if sample.t_ms > t_ms]
        for sample in due:
            if isinstance(sample, PoseSample):
                self._fuse_pose(sample, t_ms)
            elif self._parameters["EK3_SRC1_VELXY"] == _EXTERNAL:
                self._fuse_velocity(sample, t_ms)

    def _fuse_pose(self, sample: PoseSample, t_ms: int) -> None:
        state = self._state
        if state is None:
            return
        yaw = ekf.yaw_innovation(state, sample.yaw, max(sample.sigma_rad, _LEAST_YAW_SIGMA))
        ratio = _ratio(state, yaw, _YAW_GATE, slice(0, 1))
        self.variances = replace(self.variances, compass=math.sqrt(ratio))
        if ratio < 1.0:
            state = self._state = ekf.corrected(state, yaw)
        if sample.reset:
            self._move_to(sample.p_BinN)
            self.variances = replace(self.variances, position=0.0, height=0.0)
            self._passed_ms["position"] = self._passed_ms["height"] = t_ms
            return
        self._fuse_position(state, sample, t_ms)

    def _fuse_position(self, state: ekf.FilterState, sample: PoseSample, t_ms: int) -> None:
        """Fuse level position and height, each behind its own gate; what fails for too long resets the filter to it."""
        innovation = ekf.position_innovation(state, sample.p_BinN, min(sample.sigma_m, 10.0))
        level, height = _ratio(state, innovation, _GATE, slice(0, 2)), _ratio(state, innovation, _GATE, slice(2, 3))
        self.variances = replace(self.variances, position=math.sqrt(level), height=math.sqrt(height))
        kept = []
        for name, ratio, rows, retry_ms in (
            ("position", level, [0, 1], self._retry_ms()),
            ("height", height, [2], _HEIGHT_RETRY_MS),
        ):
            if ratio < 1.0:
                self._passed_ms[name] = t_ms
                kept += rows
            elif t_ms - self._passed_ms[name] > retry_ms:
                self._passed_ms[name] = t_ms
                target = state.p_BinN.copy()
                target[rows] = sample.p_BinN[rows]
                self._move_to(target)
        if kept and self._state is not None:
            part = ekf.Innovation(innovation.H[kept], innovation.difference[kept], innovation.variance[kept])
            self._state = ekf.corrected(self._state, part)

    def _fuse_velocity(self, sample: SpeedSample, t_ms: int) -> None:
        if self._state is None:
            return
        innovation = ekf.velocity_innovation(self._state, sample.v_BinN, sample.sigma_m_s)
        ratio = _ratio(self._state, innovation, _GATE, slice(0, 3))
        self.variances = replace(self.variances, velocity=math.sqrt(ratio))
        if ratio < 1.0:
            self._passed_ms["velocity"] = t_ms
            self._state = ekf.corrected(self._state, innovation)
        elif t_ms - self._passed_ms["velocity"] > self._retry_ms():
            self._passed_ms["velocity"] = t_ms
            self._state = replace(self._state, v_BinN=sample.v_BinN)

    def _move_to(self, p_BinN: Array) -> None:
        """Re-align the position; velocity and heading stay."""
        if self._state is not None:
            self.shift_inN = self.shift_inN + (p_BinN - self._state.p_BinN)
            self._state = replace(self._state, p_BinN=p_BinN)

    def _check_aiding(self) -> None:
        """Give the position up when nothing at all has been fused for long."""
        if self._now_ms - _HORIZON_MS - max(self._passed_ms.values()) > self._retry_ms() + _DEAD_RECKONING_MS:
            self._state = None
            self.variances = Variances()
            self.texts.append("EKF3 IMU0 stopped aiding")

    def _retry_ms(self) -> int:
        return _RETRY_WITH_SPEED_MS if self._parameters["EK3_SRC1_VELXY"] == _EXTERNAL else _RETRY_MS


def _ratio(state: ekf.FilterState, innovation: ekf.Innovation, gate: float, rows: slice) -> float:
    """Return the sum of squares over what the gate allows: sums of several variances, as EKF3 builds it."""
    squares = float((innovation.difference[rows] ** 2).sum())
    return squares / (gate**2 * float(innovation.spread(state)[rows].sum()))
