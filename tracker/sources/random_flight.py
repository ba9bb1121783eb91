"""Flights nobody planned: smooth, another for each seed, within what the paper's helicopter does and cameras see."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from tracker.maths import so3
from tracker.types import Array

WAVES = 3  # of each motion
SLOWEST_HZ, FASTEST_HZ = 0.1, 0.7
WOBBLE_HZ = (0.8, 2.0)
# Limits along the level line that both cameras look across, along the level line between them, and upright.
REACH_M = np.array([0.55, 0.20, 0.40])
SPEED_M_S = np.array([1.4, 0.5, 2.5])
ACCELERATION_M_S2 = np.array([2.4, 1.6, 8.0])
YAW_RATE_RAD_S, WOBBLE_RAD = math.radians(50.0), math.radians(1.5)
_GRAVITY = 9.81
_ACROSS, _BETWEEN = np.array([1.0, -1.0, 0.0]) / math.sqrt(2.0), np.array([1.0, 1.0, 0.0]) / math.sqrt(2.0)
_AXES_inW = np.stack((_ACROSS, _BETWEEN, [0.0, 0.0, 1.0]))


def random_flight(seed: int) -> Callable[[float], tuple[Array, Array]]:
    """Make up a flight: pose p_BinW (3,) [m], R_BtoW (3, 3) by the time since the start [s], for ever.

    Each motion is a sum of a few waves, scaled so that even where all their crests meet it keeps its limits. The
    vehicle leans as its acceleration demands and wobbles a little; the nose turns as it likes.
    """
    return _RandomFlight(np.random.default_rng((seed, 0x0F11)))


class _RandomFlight:
    """The waves of one flight."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._w = 2.0 * math.pi * rng.uniform(SLOWEST_HZ, FASTEST_HZ, (3, WAVES))
        self._phase = rng.uniform(0.0, 2.0 * math.pi, (3, WAVES))
        size = rng.uniform(0.3, 1.0, (3, WAVES))
        sums = [(size * self._w**power).sum(axis=1) for power in range(3)]
        limits = (REACH_M, SPEED_M_S, ACCELERATION_M_S2)
        self._size = size * np.min([limit / each for limit, each in zip(limits, sums, strict=True)], axis=0)[:, None]
        self._wobble_w = 2.0 * math.pi * rng.uniform(*WOBBLE_HZ, 2)
        self._wobble_phase = rng.uniform(0.0, 2.0 * math.pi, 2)
        self._yaw0, self._yaw_phase = rng.uniform(0.0, 2.0 * math.pi, 2).tolist()
        self._yaw_w = 2.0 * math.pi * float(rng.uniform(SLOWEST_HZ, 0.4))
        self._yaw_rate = float(rng.uniform(-0.4, 0.4)) * YAW_RATE_RAD_S

    def __call__(self, t_s: float) -> tuple[Array, Array]:
        """Return the pose at a time [s]."""
        angle = self._w * t_s + self._phase
        p_BinW = (self._size * np.sin(angle)).sum(axis=1) @ _AXES_inW
        a_BinW = -(self._size * self._w**2 * np.sin(angle)).sum(axis=1) @ _AXES_inW
        yaw = self._yaw0 + self._yaw_rate * t_s
        yaw += 0.6 * YAW_RATE_RAD_S / self._yaw_w * math.sin(self._yaw_w * t_s + self._yaw_phase)
        return p_BinW, self._lean(a_BinW, yaw, t_s)

    def _lean(self, a_BinW: Array, yaw: float, t_s: float) -> Array:
        """Tilt towards the acceleration: nose down to go forward, right side up to go left."""
        forwards = a_BinW[0] * math.cos(yaw) + a_BinW[1] * math.sin(yaw)
        leftwards = a_BinW[1] * math.cos(yaw) - a_BinW[0] * math.sin(yaw)
        roll, pitch = WOBBLE_RAD * np.sin(self._wobble_w * t_s + self._wobble_phase)
        return so3.from_euler(roll - math.atan(leftwards / _GRAVITY), pitch + math.atan(forwards / _GRAVITY), yaw)
