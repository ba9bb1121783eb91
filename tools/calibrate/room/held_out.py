"""Errors of stretches of the footage that the fit did not go by."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tools.calibrate.room.jacobian import residuals
from tools.calibrate.room.scene import Seen
from tools.calibrate.room.solve import Found
from tools.calibrate.room.start import epipolar, marker_way, normalised, sides, triangulated
from tracker.rig import Rig
from tracker.types import Array

WILD = 20.0  # times the median: no calibration errs so at single instants


@dataclass(frozen=True, slots=True)
class HeldOut:
    """What cameras make of a marker that they were not fitted to.

    instants: at which two cameras or more saw every ball.  wild: share of them at which something was taken for a ball.
    spacing_mm, worst_spacing_mm: by how much distances of balls are wrong, median and 95 % of them.
    reprojection_px: rms on an axis, the balls' poses being fitted.  epipolar_px: rms distance of one camera's ball from
    the line on which another sees it.
    """

    instants: int
    wild: float
    spacing_mm: float
    worst_spacing_mm: float
    reprojection_px: float
    epipolar_px: float


def judged(found: Found, rig: Rig) -> HeldOut:
    """Measure what was held out; NaN where nothing was."""
    seen, offsets_s, cameras = found.held_out, found.scene.offsets_s, found.cameras
    seen = seen.only(seen.there.sum(axis=0) >= 2)
    if not len(seen.t_s):
        return HeldOut(0, 0.0, *[float("nan")] * 4)
    off_mm = 1e3 * np.abs(sides(triangulated(seen, cameras, offsets_s)) - sides(rig.marker.points_inB))
    farthest_mm = off_mm.max(axis=1)
    tame = np.asarray(farthest_mm <= WILD * np.median(farthest_mm))
    count, off_mm, seen = len(seen.t_s), off_mm[tame], seen.only(tame)
    scene, fitting = marker_way(seen, cameras, offsets_s, rig)
    return HeldOut(
        count,
        float(1.0 - tame.mean()),
        float(np.median(off_mm)),
        float(np.quantile(off_mm, 0.95)),
        rms(residuals(scene, fitting)),
        rms(np.concatenate(list(_epipolar_misses(found, seen)))),
    )


def rms(values: Array) -> float:
    """Return the root of the mean square; NaN of none."""
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")


def _epipolar_misses(found: Found, seen: Seen) -> Iterator[Array]:
    """Yield by how much each ball misses its epipolar line in each pair of cameras [px]."""
    uv = seen.at(found.scene.offsets_s)
    for a, b in combinations(range(len(found.cameras)), 2):
        one, other = found.cameras[a], found.cameras[b]
        both = seen.there[a] & seen.there[b]
        t_inB = other.in_camera(one.p_CinW[None, :])[0]
        R_AtoB = other.R_CtoW.T @ one.R_CtoW
        E = np.cross(t_inB, R_AtoB, axisb=0, axisc=0)  # [t]x R, column by column
        x_a, x_b = normalised(one, uv[a, both].reshape(-1, 2)), normalised(other, uv[b, both].reshape(-1, 2))
        yield epipolar(E, x_a, x_b) * (one.focal_px + other.focal_px) / 2.0
