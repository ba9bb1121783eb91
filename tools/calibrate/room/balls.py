"""The marker's balls in one image, without knowing where the camera stands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

import cv2
import numpy as np

from tracker.camera import Camera
from tracker.image.centre import Centre, fit_centre
from tracker.image.detect import Blob
from tracker.image.look import look_everywhere
from tracker.image.patch import Expected, Response
from tracker.image.template import FLAT
from tracker.rig import Rig
from tracker.types import Array, Frame

MOST_CANDIDATES = 8  # of each ball, largest first: things in the room may be larger than a ball
LEAST_AREA_PX = 3.0
SIZES_AGREE = 0.7  # of the logarithm of a blob's radius over that at the marker's depth: blur and shade count in


def find_balls(frame: Frame, rig: Rig) -> Array | None:
    """Find the balls of the marker in an image.

    The colours name them, and the triangle of the first three tells how far away they are, and so how large each
    must look: of what else has their colours hardly anything has both.

    Returns:
        (n, 3): of each ball the sub-pixel centre u, v and what it is known to, one sigma [px]; None when not every
        ball is there.
    """
    camera = rig.cameras[frame.camera]
    blobs = [[b for b in of if b.area_px >= LEAST_AREA_PX] for of in look_everywhere(frame, camera, rig)]
    best: tuple[float, Sequence[Blob], float] | None = None
    for choice in product(*(of[:MOST_CANDIDATES] for of in blobs)):
        depth_m = _depth_m(np.array([b.uv_px for b in choice[:3]]), rig.marker.points_inB[:3], camera)
        if depth_m is None:
            continue
        misfit = max(
            abs(math.log(math.sqrt(b.area_px / math.pi) * depth_m / (camera.focal_px * ball.radius_m)))
            for b, ball in zip(choice, rig.marker.balls, strict=True)
        )
        if misfit < SIZES_AGREE and (best is None or misfit < best[0]):
            best = misfit, choice, depth_m
    return None if best is None else _centres(frame, rig, best[1], best[2])


def _depth_m(uv_px: Array, points_inB: Array, camera: Camera) -> float | None:
    """Return about how far before a camera a triangle of known sides is that it sees so; None for no solution."""
    rays = camera.bearings(uv_px)
    normalised = rays[:, :2] / rays[:, 2:]
    count, _, shifts = cv2.solveP3P(np.array(points_inB), normalised, np.eye(3), np.zeros(4), cv2.SOLVEPNP_P3P)
    depths = [float(t[2, 0]) for t in shifts[:count]] if count else []
    ahead = [z for z in depths if math.isfinite(z) and z > 0.0]
    return float(np.median(ahead)) if ahead else None


def _centres(frame: Frame, rig: Rig, blobs: Sequence[Blob], depth_m: float) -> Array | None:
    centres = np.empty((len(blobs), 3))
    for k, (blob, ball) in enumerate(zip(blobs, rig.marker.balls, strict=True)):
        radius_px = rig.cameras[frame.camera].focal_px * ball.radius_m / depth_m
        u, v = blob.uv_px.tolist()
        fit = fit_centre(frame.image, Expected((u, v), radius_px, (0.0, 0.0), FLAT, Response()))
        if not isinstance(fit, Centre):
            return None
        centres[k] = *fit.uv_px, sigma_px(fit)
    return centres


def sigma_px(fit: Centre) -> float:
    """Return what a centre is known to by its image alone, one sigma on each axis [px]."""
    return math.sqrt(float(np.trace(fit.cov_px)) / 2.0)
