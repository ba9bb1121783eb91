"""A ball fitted as its camera encodes light: where it is, and what its image says of that encoding."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tools.calibrate.room.encoded import OWN, SHAPES, U, V, fit_encoded
from tracker.image.appearance import MISFIT_MAX, Appearance
from tracker.image.behind import NO_ROOM
from tracker.image.centre import Centre, numbers_of
from tracker.image.exposure import CLIPPED, LUMA_WEIGHTS
from tracker.image.holder import without_holders
from tracker.image.patch import FULL_TRUST, RING_PX, TRUST, Expected, Patch, extent_of, light_of
from tracker.image.template import MARGIN_PX, template_for
from tracker.image.whiten import SCALES, whitening
from tracker.types import Array, Image, frozen_array

APART_PX = 0.7  # from the fit in light; further away it has found something else
NOTHING = np.empty((0, 0))  # of what sightings share


@dataclass(frozen=True, slots=True, eq=False)
class Encoding:
    """How a camera keeps what it sees.

    smoothing: share of a block's colour that is a neighbour's.
    paints (balls, 3): light of each ball, blue, green, red, up to a factor.
    """

    appearance: Appearance
    smoothing: float
    paints: Array

    @property
    def gamma(self) -> float:
        """Return the camera's gamma."""
        return self.appearance.response.gamma


@dataclass(frozen=True, slots=True, eq=False)
class Square:
    """The pixels round a ball, in whole blocks. left, top [px]: where.  side: how many blocks.

    pixels (2, n): x, y from the patch's middle pixel.  trust (n,), trust_colour (blocks,).
    """

    left: int
    top: int
    side: int
    pixels: Array
    trust: Array
    trust_colour: Array


def square_of(image: Image, ball: Expected) -> Square | None:
    """Return the pixels round a ball without what holds it; None where they leave the image."""
    extent = extent_of(ball)
    left, top = (extent.u - extent.half) & ~1, (extent.v - extent.half) & ~1
    side = max(extent.u + extent.half - left, extent.v + extent.half - top) // 2 + 1
    if left < 0 or top < 0 or left + 2 * side > image.shape[1] or top + 2 * side > image.shape[0]:
        return None
    rows, columns = np.mgrid[: 2 * side, : 2 * side]
    x, y = left + columns.ravel() - extent.u, top + rows.ravel() - extent.v
    near = np.hypot(x - extent.du, y - extent.dv) < extent.edge_px + MARGIN_PX
    full = image[top : top + 2 * side, left : left + 2 * side].max(axis=2).ravel() >= CLIPPED
    pixels = np.array((x, y, near * np.where(full, FULL_TRUST, 1.0)), dtype=np.float64)
    in_blocks = pixels.reshape(3, side, 2, side, 2)
    blocks = np.concatenate((in_blocks[:2].mean(axis=(2, 4)), in_blocks[2:].min(axis=(2, 4)))).reshape(3, -1)
    seen = without_holders(Patch(pixels, blocks), extent, ball)
    return Square(left, top, side, pixels[:2], seen.bright[TRUST], seen.colour[TRUST])


def fitted(image: Image, ball: Expected, known: Encoding, which: int, shared: Array) -> Centre | None:
    """Fit a ball as a camera encodes it.

    Args:
        ball: what is known of it, its centre within half a pixel.
        which: of the paints.
        shared: see `fit_encoded`.
    Returns:
        Its centre, with chi2 of its brightness alone; None where nothing fits.
    Raises:
        ValueError: the ball's light is not known.
    """
    if len(ball.shades.weights) != SHAPES:  # the compiled fit checks no index
        raise ValueError(f"a ball of {len(ball.shades.weights)} shapes: must be {SHAPES}; learn its light first")
    square = square_of(image, ball)
    if square is None:
        return None
    extent, scale, covariance = extent_of(ball), np.zeros(SCALES), np.empty((2, 2))
    u, v, du, dv = extent.u, extent.v, extent.du, extent.dv
    whitening(image, NO_ROOM.mean, False, u, v, extent.half, 2, du, dv, extent.edge_px + RING_PX, LUMA_WEIGHTS, scale)
    own = np.zeros(OWN)
    own[U], own[V] = du, dv
    response = ball.response
    part = np.ascontiguousarray(
        image[square.top : square.top + 2 * square.side, square.left : square.left + 2 * square.side]
    )
    template = template_for(ball.radius_px, response.luma_px, ball.shades)
    misfit = fit_encoded(
        part, square.pixels, square.trust, square.trust_colour, square.side, scale, *template, numbers_of(ball),
        response.gamma, known.smoothing, known.paints[which], light_of(response.gamma), own, covariance, shared,
    )  # fmt: skip
    if not (math.hypot(own[U] - du, own[V] - dv) < APART_PX and misfit < MISFIT_MAX):
        return None
    return Centre(frozen_array((u + own[U], v + own[V])), frozen_array(covariance), misfit)
