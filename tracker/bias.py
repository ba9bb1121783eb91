"""Errors that all balls share, which no residual shows and no averaging removes.

Light that is not quite as modelled, and blur along a streak that is not quite even, move the images of all balls of a
camera alike. The marker keeps its shape, so the filter sees nothing amiss: only the reported position can be honest
about it.
"""

from __future__ import annotations

import numpy as np

from tracker.rig import Rig
from tracker.state import State
from tracker.types import Array

LIGHT_PX = 0.02  # one sigma that light learned from balls leaves, in simulated rooms of other lamps and gammas
STREAK_SHARE = 0.01  # of the streak: what it leaves


def shared_covariance(state: State, rig: Rig, exposure_s: float) -> Array:
    """Return the covariance (3, 3) of the position by errors that all balls of a camera share [m^2].

    Source: a shift of all images by noise of one sigma s in each camera is a measurement of the position with slope
        f / d (I - u u'), u the ray, d the distance; so the covariance is (sum (f / d s)^2 (I - u u'))^-1. s grows with
        the streak f / d |(I - u u') v| exposure.
    """
    information = np.zeros((3, 3))
    for camera in rig.cameras:
        reach = state.p_BinW - camera.p_CinW
        distance_m = float(np.linalg.norm(reach))
        u = reach / distance_m
        across = np.eye(3) - np.outer(u, u)
        scale = camera.focal_px / distance_m
        streak_px = scale * float(np.linalg.norm(across @ state.v_BinW)) * exposure_s
        information += (scale**2 / (LIGHT_PX**2 + (STREAK_SHARE * streak_px) ** 2)) * across
    return np.asarray(np.linalg.inv(information))
