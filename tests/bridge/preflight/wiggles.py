"""A vehicle wiggled by hand: its attitude, what a gyro on it reads, and what the bridge says of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation, RotationSpline

from tracker.maths import so3
from tracker.types import Array

START_NS = 5_000_000_000


@dataclass(frozen=True)
class Wiggle:
    """Stamps [ns] and attitudes of poses, times [ns] and rates of the gyro [rad/s]."""

    pose_t_ns: list[int]
    R_FtoN: list[Array]
    gyro_t_ns: list[int]
    w_G: list[Array]


def wiggle(
    seed: int,
    late_s: float,
    duration_s: float = 12.0,
    size: float = 0.35,
    axes: tuple[float, float, float] = (1.0, 1.0, 1.0),
    R_GtoF: Array | None = None,
    pose_hz: float = 30.0,
    gyro_hz: float = 50.0,
    attitude_sigma: float = 0.004,
    gyro_sigma: float = 0.01,
) -> Wiggle:
    """Make one. late_s: stamps minus truth [s].  size: of the knots' angles [rad].

    R_GtoF: the gyro's axes in the bridge's body, none for the same.
    """
    random = np.random.default_rng(seed)
    knots = np.arange(-1.0, duration_s + 1.5, 0.25)
    path = RotationSpline(knots, Rotation.from_rotvec(random.normal(0.0, size, (len(knots), 3)) * axes))
    gyro_s = np.arange(0.0, duration_s, 1.0 / gyro_hz)
    rates = path(gyro_s, 1)  # scipy's are in the rotated frame's own axes: Rotation maps body to reference
    turn = np.eye(3) if R_GtoF is None else R_GtoF
    w = rates @ turn + random.normal(0.0, gyro_sigma, rates.shape) + [0.01, -0.02, 0.015]
    pose_s = np.sort(np.arange(0.0, duration_s, 1.0 / pose_hz) + random.uniform(0.0, 0.003))
    attitudes = [R @ so3.exp(random.normal(0.0, attitude_sigma, 3)) for R in path(pose_s).as_matrix()]
    return Wiggle(
        [START_NS + round(1e9 * (t + late_s)) for t in pose_s],
        attitudes,
        [START_NS + round(1e9 * t) for t in gyro_s],
        list(w),
    )
