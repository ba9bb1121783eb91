"""Errors that all balls share, which no residual shows and no averaging removes.

Light that is not quite as modelled, and blur along a streak that is not quite even, move the images of all balls of a
camera alike. The marker keeps its shape, so the filter sees nothing amiss: only the reported position can be honest
about it.
"""

from __future__ import annotations

import math

import numpy as np

from tracker.filter.measure import camera_table
from tracker.maths.compiled import compiled
from tracker.maths.covariance import inverse_of
from tracker.rig import Rig
from tracker.state import State
from tracker.types import Array

LIGHT_PX = 0.015  # one sigma that learned light leaves however clearly balls show; more by `tracker.image.clarity`
STREAK_SHARE = 0.01  # of the streak: what it leaves


def shared_covariance(state: State, rig: Rig, exposure_s: float, doubts_px: Array) -> Array:
    """Return the covariance (3, 3) of the position by errors that all balls of a camera share [m^2].

    doubts_px: (cameras,) one sigma of what a camera's light and gamma, not quite known, and a knock leave [px].
    Source: a shift of all images by noise of one sigma s in each camera is a measurement of the position with slope
        f / d (I - u u'), u the ray, d the distance; so the covariance is (sum (f / d s)^2 (I - u u'))^-1. s grows with
        the streak f / d |(I - u u') v| exposure, and with the doubts.
    """
    return shared(state.mean, camera_table(rig), exposure_s, doubts_px)


@compiled("f8[:, ::1](f8[::1], f8[:, ::1], f8, f8[::1])")
def shared(mean: Array, table: Array, exposure_s: float, doubts_px: Array) -> Array:
    """Return what `shared_covariance` does, of a `State.mean` and a `camera_table`."""
    information, u = np.zeros((3, 3)), np.empty(3)
    for c in range(len(table)):
        distance2, speed2, along = 0.0, 0.0, 0.0
        for i in range(3):
            u[i] = mean[i] - table[c, 21 + i]
            distance2 += u[i] * u[i]
        distance_m = math.sqrt(distance2)
        u /= distance_m
        for i in range(3):
            speed2 += mean[12 + i] * mean[12 + i]
            along += mean[12 + i] * u[i]
        scale = (table[c, 0] + table[c, 1]) / 2.0 / distance_m
        streak_px = scale * math.sqrt(max(speed2 - along * along, 0.0)) * exposure_s
        weight = scale**2 / (LIGHT_PX**2 + (STREAK_SHARE * streak_px) ** 2 + doubts_px[c] ** 2)
        for i in range(3):
            information[i, i] += weight
            for j in range(3):
                information[i, j] -= weight * u[i] * u[j]
    return inverse_of(information)
