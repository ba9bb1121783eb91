"""What holds a ball, left out of its image.

A ball sits on a tube that leads to the others. Darker than ball and room, and always on the same side, it draws the fit
of the brightness towards it by some hundredths of a pixel: too little for pixels to stand out as strangers.
"""

from __future__ import annotations

import math

import numpy as np

from tracker.image.patch import TRUST, Expected, Extent, Patch, X, Y
from tracker.types import Array

WITHIN, HALF_WIDTH = 0.5, 0.5  # radii: from how far out in the ball it is left out, and to either side of its middle
LEFT_OUT = 1e-3  # of the trust, as of pixels that fit no ball
SEEN_FROM_ITS_END = 1.5  # radii: a tube no longer than this in the image is before the ball or behind it


def without_holder(patch: Patch, extent: Extent, ball: Expected, towards_px: tuple[float, float]) -> Patch:
    """Return a patch that does not trust the pixels on a ball's one side.

    towards_px: where in the image the tube leads to.
    """
    du, dv = towards_px[0] - ball.uv_px[0], towards_px[1] - ball.uv_px[1]
    length_px = math.hypot(du, dv)
    if length_px < SEEN_FROM_ITS_END * ball.radius_px:
        return patch
    along = du / length_px, dv / length_px
    swept_px = abs(ball.streak_px[0] * along[1] - ball.streak_px[1] * along[0]) / 2.0
    bright, colour = (
        _without(pixels, extent, ball.radius_px, along, swept_px) for pixels in (patch.bright, patch.colour)
    )
    return Patch(bright, colour)


def _without(pixels: Array, extent: Extent, radius_px: float, along: tuple[float, float], swept_px: float) -> Array:
    x, y = pixels[X] - extent.du, pixels[Y] - extent.dv
    ahead_px, aside_px = x * along[0] + y * along[1], np.abs(x * along[1] - y * along[0])
    holder = (ahead_px > WITHIN * radius_px) & (aside_px < HALF_WIDTH * radius_px + swept_px)
    trusted = pixels.copy()
    trusted[TRUST, holder] *= LEFT_OUT
    return trusted
