"""The outline of a ball in an image: an oval, and its middle is not where the ball's centre is projected.

A ball seen aside of a camera's axis is longer away from the middle of the image than across, by 1 / cos of the angle,
and a lens's distortion makes it smaller or larger, along and across by different shares: a wide lens's corner shows it
smaller by a tenth. To look for a larger one there pulls the centre to where the ball is bright, as unknown light would.
"""

from __future__ import annotations

import math

import numpy as np

from tracker.filter.measure import project
from tracker.maths.compiled import compiled
from tracker.types import Array

POINTS = 8  # of an outline that are projected
RADIUS, LONGER_U, LONGER_UV, SHIFT_U, SHIFT_V, OUTLINE_SIZE = range(6)
"""What is told of an outline: the radius of the disc as large [px]; by what share it is longer along u than that, and
shorter along v, and the same of the diagonals; how far its middle is from where the ball's centre is projected [px]."""
_ROUND = np.array([(math.cos(angle), math.sin(angle)) for angle in 2.0 * math.pi * np.arange(POINTS) / POINTS])


@compiled("void(f8[::1], f8, f8[::1], f8[:, ::1], f8[::1])")
def outline(ball_inW: Array, radius_m: float, camera: Array, work: Array, told: Array) -> None:
    """Fill in told (OUTLINE_SIZE,); infinity behind the camera.

    Args:
        ball_inW: (3,) its centre.  camera: a row of `camera_table`.  work (7, 3): overwritten.
    Source: with J = d pixel / d point and A = r J on two axes across the ray, the outline is A w to the first order,
        |w| = 1, an ellipse: A A' = r^2 J J', since J has nothing along the ray, is det A exp(2 e), e without trace and
        told here. Beyond the first order it is A d(w): what of d leads outwards and goes with w is a shift,
        2 mean(w (w . d)); for a pinhole it is the radius's square by the depth's, times the place in the image.
    """
    J, scratch, first, second, point = work[:2], work[2:4], work[4], work[5], work[6]
    u, v = project(ball_inW, camera, J)
    if not math.isfinite(u + v):
        told[:] = 0.0
        told[RADIUS] = math.inf
        return
    uu = uv = vv = 0.0
    for i in range(3):
        uu, uv, vv = uu + J[0, i] * J[0, i], uv + J[0, i] * J[1, i], vv + J[1, i] * J[1, i]
    along = math.sqrt(uu)
    aslant = uv / along
    across = math.sqrt(vv - aslant * aslant)
    for i in range(3):  # two axes across the ray, in which A is a triangle
        first[i] = J[0, i] / along
        second[i] = (J[1, i] - aslant * first[i]) / across
    size = along * across
    told[RADIUS] = radius_m * math.sqrt(size)
    told[LONGER_U], told[LONGER_UV] = (uu - vv) / (4.0 * size), uv / (2.0 * size)
    shift_first = shift_second = 0.0
    for k in range(POINTS):
        x, y = _ROUND[k]
        for i in range(3):
            point[i] = ball_inW[i] + radius_m * (x * first[i] + y * second[i])
        at_u, at_v = project(point, camera, scratch)
        d_first = (at_u - u) / along
        d_second = (at_v - v - aslant * d_first) / across
        outwards = 2.0 / POINTS * (x * d_first + y * d_second)
        shift_first += x * outwards
        shift_second += y * outwards
    told[SHIFT_U] = along * shift_first
    told[SHIFT_V] = aslant * shift_first + across * shift_second
