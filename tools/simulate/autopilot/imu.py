"""The autopilot's own gyro and accelerometer."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tools.simulate.dynamics import GRAVITY
from tools.simulate.helicopter import State
from tracker.maths import so3
from tracker.types import Array

FLIP = np.array([1.0, -1.0, -1.0])
"""B (forward, left, up) to F (forward, right, down) and back."""

_GRAVITY_inW = np.array([0.0, 0.0, -GRAVITY])


@dataclass(frozen=True, slots=True, eq=False)
class Increment:
    """What an IMU sums up over dt_s: turn (3,) [rad] and change of speed without gravity (3,) [m/s].

    The turn is a rotation vector, the speed in F as it stood at the start.
    """

    dt_s: float
    turn_inF: Array
    speed_inF: Array


@dataclass(frozen=True, slots=True)
class ImuNoise:
    """One sigma of a small MEMS unit's noise, densities over one second, and of the biases its calibration leaves."""

    gyro_rad_s: float = 1e-4
    accel_m_s2: float = 2e-3
    gyro_bias_rad_s: float = 3e-4
    accel_bias_m_s2: float = 0.02


class Imu:
    """Sum the true motion up between two readings, and add noise and bias. rng: the noise's source."""

    def __init__(self, noise: ImuNoise, rng: np.random.Generator) -> None:
        self._noise = noise
        self._rng = rng
        self._gyro_bias = noise.gyro_bias_rad_s * rng.standard_normal(3)
        self._accel_bias = noise.accel_bias_m_s2 * rng.standard_normal(3)

    def read(self, before: State, after: State, dt_s: float) -> Increment:
        """Return what was measured from one true state to the next, dt_s later.

        Exact integrals: turn = log(R0' R1), speed = R0' (v1 - v0 - g dt).
        """
        turn_inB = so3.log(before.R_BtoW.T @ after.R_BtoW)
        speed_inB = before.R_BtoW.T @ (after.v_BinW - before.v_BinW - _GRAVITY_inW * dt_s)
        root_s = math.sqrt(dt_s)
        turn = FLIP * turn_inB + self._gyro_bias * dt_s + self._noise.gyro_rad_s * root_s * self._rng.standard_normal(3)
        speed = (
            FLIP * speed_inB + self._accel_bias * dt_s + self._noise.accel_m_s2 * root_s * self._rng.standard_normal(3)
        )
        return Increment(dt_s, turn, speed)
