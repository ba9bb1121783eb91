"""Where the autopilot believes to be: its filter at a delayed horizon, with EKF3's gates, time-outs and start.

Source: ArduPilot's AP_NavEKF3 as of 4.8 development, one core, external vision, IMU and a barometer to fall back on;
times as measured in its SITL.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from tools.simulate.autopilot import ekf
from tools.simulate.autopilot.aiding import HEIGHT, LEVEL, SPEED, Aiding, horizon_ms, is_fresh
from tools.simulate.autopilot.imu import Increment
from tools.simulate.autopilot.origins import INITIALISED_MS, Origin, Origins
from tools.simulate.autopilot.parameters import Parameters
from tools.simulate.autopilot.vision import PoseSample, SpeedSample
from tracker.maths import so3
from tracker.types import Array

ALIGNED_MS = 5400
"""Time after boot: the filter is level."""

_EXTERNAL = 6
_GATE, _YAW_GATE, _YAW_STEP = 5.0, 3.0, 0.5
_LEAST_YAW_SIGMA = math.radians(5.0)
_BAROMETER_SIGMA_M, _BAROMETER_MS = 0.05, 100


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


class Navigation:
    """The filter with its buffer of IMU readings: samples are fused when their own time has come.

    flies: whether the vehicle is in the air; on the ground a heading beyond its gate is followed.
    """

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._horizon_ms = horizon_ms(parameters["VISO_DELAY_MS"])
        self._rng = np.random.default_rng(3)
        self._aiding = Aiding(0)
        self._newest_ms = 0
        self._by_barometer = False
        self._barometer_ms = 0
        self._buffer: deque[tuple[int, Increment]] = deque()
        self._samples: list[PoseSample | SpeedSample] = []
        self._state: ekf.FilterState | None = None
        self._now_ms = 0
        self._origins = Origins()
        self.flies = False
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
        """Say whether position is known, and the filter in health: one of its three ratios keeps its gate."""
        ratios = self.variances
        ill = min(ratios.velocity, ratios.position, ratios.height) > 1.0
        return self._state is not None and not self._aiding.lost_level and not ill

    def set_origin(self, origin: Origin) -> bool:
        """Set the origin; say whether it is acknowledged."""
        acknowledged = self._origins.take(origin, self._now_ms)
        self.texts += ["EKF3 IMU0 origin set"] * acknowledged
        return acknowledged

    @property
    def origin(self) -> Origin | None:
        """Return the origin it has."""
        return self._origins.kept

    @property
    def answered_origin(self) -> Origin | None:
        """Return the origin it says it has."""
        return self._origins.promised

    def take(self, samples: tuple[PoseSample | SpeedSample, ...]) -> None:
        """Take what vision brings."""
        self._samples += samples
        delay_ms = round(self._parameters["VISO_DELAY_MS"])
        for sample in samples:
            if isinstance(sample, PoseSample):
                self._newest_ms = sample.t_ms + delay_ms

    def advance(self, now_ms: int, increment: Increment) -> None:
        """Go on to now_ms with what the IMU summed up since the last call."""
        self._tell_of_start(now_ms)
        self._now_ms = now_ms
        self._buffer.append((now_ms, increment))
        if self._state is None:
            self._start()
            return
        while self._state is not None and self._buffer and self._buffer[0][0] <= now_ms - self._horizon_ms:
            t_ms, oldest = self._buffer.popleft()
            self._state = ekf.predicted(self._state, oldest)
            self._aiding.advance(t_ms)
            if t_ms // _BAROMETER_MS != self._barometer_ms // _BAROMETER_MS:
                self._barometer_ms = t_ms
                self._fall_back()
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
        """Return EKF_STATUS_FLAGS: 0x400 until it runs, 0xa7 before the first position and once it is given up,
        0x33f with it, an origin or none, 0x25 while it counts as lost.
        """
        if not self.runs:
            return 0x400
        if self._now_ms < ALIGNED_MS:
            return 0
        if self._state is None:
            return 0xA7
        return 0x33F if self.aided else 0x25

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
            while self._buffer and self._buffer[0][0] <= self._now_ms - self._horizon_ms:
                self._buffer.popleft()
            return
        self._state = ekf.started(pose.p_BinN, ekf.levelled(self._buffer[-1][1].speed_inF, pose.yaw))
        self._buffer.clear()
        self._samples.clear()
        self._aiding = Aiding(self._now_ms - self._horizon_ms)
        self._by_barometer = False
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
                self._fuse_pose(sample)
            elif self._parameters["EK3_SRC1_VELXY"] == _EXTERNAL:
                self._fuse_velocity(sample)

    def _fuse_pose(self, sample: PoseSample) -> None:
        state = self._state
        if state is None:
            return
        state = self._state = self._turned(state, sample)
        self._land_on_vision(sample)
        if sample.reset:
            self._move_to(sample.p_BinN)
            self.variances = replace(self.variances, position=0.0, height=0.0)
            self._aiding.note_passed(LEVEL)
            self._aiding.note_passed(HEIGHT)
            return
        self._fuse_position(self._state, sample)

    def _turned(self, state: ekf.FilterState, sample: PoseSample) -> ekf.FilterState:
        """Fuse the heading: in the air behind its gate, for ever; on the ground always, half a radian at a time."""
        yaw = ekf.yaw_innovation(state, sample.yaw, max(sample.sigma_rad, _LEAST_YAW_SIGMA))
        ratio = yaw.ratio(state, _YAW_GATE, slice(0, 1))
        self.variances = replace(self.variances, compass=math.sqrt(ratio))
        if ratio > 1.0 and self.flies:
            return state
        return ekf.corrected(state, replace(yaw, difference=np.clip(yaw.difference, -_YAW_STEP, _YAW_STEP)))

    def _fuse_position(self, state: ekf.FilterState, sample: PoseSample) -> None:
        """Fuse level position and height, each behind its own gate; what counts as lost is reset to the next."""
        innovation = ekf.position_innovation(state, sample.p_BinN, min(sample.sigma_m, 10.0))
        level, height = innovation.ratio(state, _GATE, slice(0, 2)), innovation.ratio(state, _GATE, slice(2, 3))
        self.variances = replace(self.variances, position=math.sqrt(level), height=math.sqrt(height))
        kept = []
        for what, ratio, rows, lost in (
            (LEVEL, level, [0, 1], self._aiding.lost_level),
            (HEIGHT, height, [2], self._aiding.lost_height),
        )[: 1 if self._by_barometer else 2]:
            if lost:
                target = state.p_BinN.copy()
                target[rows] = sample.p_BinN[rows]
                self._move_to(target)
                state = self._state or state
            elif ratio < 1.0:
                kept += rows
            if lost or ratio < 1.0:
                self._aiding.note_passed(what)
        if kept and self._state is not None:
            part = ekf.Innovation(innovation.H[kept], innovation.difference[kept], innovation.variance[kept])
            self._state = ekf.corrected(self._state, part)

    def _fuse_velocity(self, sample: SpeedSample) -> None:
        if self._state is None:
            return
        innovation = ekf.velocity_innovation(self._state, sample.v_BinN, sample.sigma_m_s)
        ratio = innovation.ratio(self._state, _GATE, slice(0, 3))
        self.variances = replace(self.variances, velocity=math.sqrt(ratio))
        if self._aiding.lost_speed:
            self._state = replace(self._state, v_BinN=sample.v_BinN)
        elif ratio < 1.0:
            self._state = ekf.corrected(self._state, innovation)
        else:
            return
        self._aiding.note_passed(SPEED)

    def _fall_back(self) -> None:
        """Without fresh poses take the height from the barometer: it differs by the noise of its first reading."""
        if self._state is not None and not self._by_barometer and not is_fresh(self._newest_ms, self._now_ms):
            self._by_barometer = True
            step_m = _BAROMETER_SIGMA_M * float(self._rng.standard_normal())
            self._move_to(self._state.p_BinN + np.array([0.0, 0.0, step_m]))
        if self._by_barometer:
            self._aiding.note_passed(HEIGHT)

    def _land_on_vision(self, sample: PoseSample) -> None:
        """With fresh poses the height is theirs again, at once."""
        if self._state is not None and self._by_barometer and is_fresh(self._newest_ms, self._now_ms):
            self._by_barometer = False
            self._move_to(np.append(self._state.p_BinN[:2], sample.p_BinN[2]))

    def _move_to(self, p_BinN: Array) -> None:
        """Re-align the position; velocity and heading stay."""
        if self._state is not None:
            self.shift_inN = self.shift_inN + (p_BinN - self._state.p_BinN)
            self._state = replace(self._state, p_BinN=p_BinN)

    def _check_aiding(self) -> None:
        """Give the position up when nothing at all has been fused for long."""
        if self._aiding.over:
            self._state = None
            self.variances = Variances()
            self.texts.append("EKF3 IMU0 stopped aiding")
