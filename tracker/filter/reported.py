"""How well a state is known that goes out, with what the filter itself cannot see."""

from __future__ import annotations

import math

import numpy as np

from tracker.filter.bias import shared
from tracker.filter.measure import camera_table
from tracker.filter.sag import sag
from tracker.maths.compiled import compiled
from tracker.rig import Rig
from tracker.state import OFFSETS, REPORTED, State
from tracker.types import Array


def reported(
    state: State, spread: float, rig: Rig, exposure_s: float, doubts_px: Array, moved_px: Array
) -> tuple[Array, Array]:
    """Return covariance and clock sigmas as an `Estimate` has them, read-only.

    Args:
        spread: see `Update`.
        exposure_s: of the slowest shutter.
        doubts_px, moved_px: (cameras,) one sigma of what light and gamma, not quite known, and a knock leave [px].
    Returns:
        (12, 12) [m, rad, m/s, rad/s], that of `shared_covariance` and `sag_covariance` included, and (cameras,) [s].
    """
    covariance, sigmas_s = _reported(state.mean, state.P, spread, camera_table(rig), exposure_s, doubts_px, moved_px)
    covariance.flags.writeable = sigmas_s.flags.writeable = False
    return covariance, sigmas_s


@compiled("Tuple((f8[:, ::1], f8[::1]))(f8[::1], f8[:, ::1], f8, f8[:, ::1], f8, f8[::1], f8[::1])")
def _reported(
    mean: Array, P: Array, spread: float, table: Array, exposure_s: float, doubts_px: Array, moved_px: Array
) -> tuple[Array, Array]:
    """Return what `reported` does, of a `State.mean` and a `camera_table`."""
    covariance, sigmas_s = spread * P[:REPORTED, :REPORTED], np.zeros(len(table))
    unseen = shared(mean, table, exposure_s, np.hypot(doubts_px, moved_px))
    covariance[:3, :3] += unseen + sag(mean[3:12].copy().reshape(3, 3), P)
    for c in range(1, len(table)):
        sigmas_s[c] = math.sqrt(P[OFFSETS + c - 1, OFFSETS + c - 1])
    return covariance, sigmas_s
