"""A small vehicle that flies about: thrust along its mast, drag, gusts, and what is measured of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tracker.types import Array

G = 9.81


@dataclass(frozen=True)
class Sample:
    """One pose and the tilt that goes with it: v north, east [m/s], yaw as reported, roll and pitch [rad]."""

    t_ns: int
    v_N: Array
    yaw: float
    roll: float
    pitch: float


def fly(
    seed: int,
    duration_s: float = 40.0,
    yaw_error_deg: float = 0.0,
    tilt_deg: float = 3.0,
    drag_1_s: float = 0.4,
    circle_rad_s: float | None = None,
    steady: tuple[float, float] = (0.3, -0.2),
    rate_hz: float = 15.0,
    gust_m_s2: float = 0.05,
) -> Iterator[Sample]:
    """Fly it; the yaw turns slowly and is reported wrong by yaw_error_deg.

    circle_rad_s: tilt that goes round at this rate, else at random.  steady: acceleration by wind and trim [m/s^2].
    """
    random = np.random.default_rng(seed)
    dt = 0.005
    phases, rates = random.uniform(0, 6.28, (2, 4)), random.uniform(0.3, 3.0, (2, 4))
    v, gust = np.zeros(2), np.zeros(2)
    for k in range(round(duration_s / dt)):
        t = k * dt
        yaw = 0.3 * t
        if circle_rad_s is None:
            lean = np.radians(tilt_deg) * np.sin(rates * t + phases).sum(axis=1) / np.sqrt(2.0)
        else:
            angle = circle_rad_s * t
            lean = np.radians(tilt_deg) * np.array([np.cos(angle), np.sin(angle)])  # north, east
        # Lean north and east, in the body: pitch down leans forward, roll right leans right.
        forward = lean[0] * np.cos(yaw) + lean[1] * np.sin(yaw)
        right = -lean[0] * np.sin(yaw) + lean[1] * np.cos(yaw)
        pitch = -np.arctan(forward)
        roll = np.arctan(right * np.cos(pitch))
        gust += dt * (-gust / 0.5) + gust_m_s2 * np.sqrt(2 * dt / 0.5) * random.normal(size=2)
        v = v + dt * (G * lean - drag_1_s * v + np.array(steady) + gust)
        if k % round(1.0 / (rate_hz * dt)) == 0:
            noisy = random.normal(0.0, np.radians(0.3), 2)
            yield Sample(
                round(1e9 * t),
                v + random.normal(0.0, 0.005, 2),
                yaw + np.radians(yaw_error_deg),
                roll + noisy[0],
                pitch + noisy[1],
            )
