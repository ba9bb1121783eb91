"""What holds a ball, left out of its image as far as it is known.

A ball sits on a tube, or on two. Darker than ball and room, and always on the same side, they draw the fit of the
brightness towards them by some hundredths of a pixel: too little for pixels to stand out as strangers.
"""

from __future__ import annotations

import math

import numpy as np

from tracker.image.patch import NOT_HELD, TRUST, Expected, Extent, Patch, X, Y
from tracker.maths.compiled import compiled
from tracker.types import Array

WITHIN, HALF_WIDTH = 0.5, 0.35  # radii: from how far out in the ball it is left out, and to either side of its middle
LEFT_OUT = 1e6  # as good as not looked at
SEEN_FROM_ITS_END = 1.5  # radii: a tube no longer than this in the image is before the ball or behind it
ALONG_U, ALONG_V, EXCESS = range(3)
"""Of something that holds a ball: where in the image it leads to, a unit vector, and by how much more its pixels
leave than others do, squared; 0 for nothing."""


@compiled("void(f8[:, ::1], f8[:, ::1], f8, f8, f8, f8, f8)")
def distrust(
    pixels: Array, held: Array, radius_px: float, streak_u: float, streak_v: float, u: float, v: float
) -> None:
    """Trust those pixels (..., n) less that show what holds a ball with its centre at (u, v), from the middle pixel.

    held (any, 3): by ALONG_U, ALONG_V, EXCESS. Smear across it makes it fainter.
    """
    for k in range(len(held)):
        along_u, along_v, excess = held[k, ALONG_U], held[k, ALONG_V], held[k, EXCESS]
        if excess <= 0.0:
            continue
        half_px = HALF_WIDTH * radius_px
        wide_px = half_px + abs(streak_u * along_v - streak_v * along_u) / 2.0
        belief = 1.0 / math.sqrt(1.0 + excess * (half_px / wide_px) ** 2)
        for i in range(pixels.shape[1]):
            x, y = pixels[X, i] - u, pixels[Y, i] - v
            if x * along_u + y * along_v > WITHIN * radius_px and abs(x * along_v - y * along_u) < wide_px:
                pixels[TRUST, i] *= belief


def held_towards(uv_px: tuple[float, float], towards_px: tuple[float, float], radius_px: float) -> Array:
    """Return what holds a ball at uv_px if it leads to another place in the image, for `Expected.held`."""
    du, dv = towards_px[0] - uv_px[0], towards_px[1] - uv_px[1]
    length_px = math.hypot(du, dv)
    if length_px < SEEN_FROM_ITS_END * radius_px:
        return NOT_HELD
    return np.array(((du / length_px, dv / length_px, LEFT_OUT),))


def without_holders(patch: Patch, extent: Extent, ball: Expected) -> Patch:
    """Return a patch, its pixels trusted less where they show what is known to hold the ball. It is changed."""
    for pixels in (patch.bright, patch.colour):
        distrust(pixels, ball.held, ball.radius_px, *ball.streak_px, extent.du, extent.dv)
    return patch
