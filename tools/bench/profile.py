"""What a ball's image looks like when everything about it is known, drawn apart from the tracker's own templates.

Drawn sharp on a fine grid, smeared by motion, blurred by lens and pixel, read off at the pixels. Shading is a sum of
the normal's polynomials up to the second degree, which hold all but a hundredth of what any light makes of a matt ball
(R. Basri, D. Jacobs, "Lambertian reflectance and linear subspaces", IEEE Trans. PAMI 25, 2003).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.types import Array

PER_PX = 7  # odd: pixels' centres and edges lie on the grid
TERMS = 6


@dataclass(frozen=True, slots=True)
class Disc:
    """A ball's image: radius [px], its smear over the exposure (u, v) [px] and the lens's blur, one sigma [px]."""

    radius_px: float
    streak_px: tuple[float, float]
    blur_px: float


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """Shapes (TERMS, n), the first the coverage, and their slopes (TERMS, n, 2) by the centre's u and v [1/px]."""

    shapes: Array
    slopes: Array


def draw(disc: Disc, offset_px: Array, half: int) -> Drawn:
    """Draw a ball on a patch of n = (2 half + 1)^2 pixels, offset_px (2,) from its middle pixel."""
    reach = half + 2
    axis = np.arange(-reach * PER_PX, reach * PER_PX + 1) / PER_PX
    length = math.hypot(*disc.streak_px)
    places = math.ceil(3.0 * length) | 1
    sharp = np.zeros((TERMS, len(axis), len(axis)), dtype=np.float32)
    for k in range(places):
        at = offset_px + ((k + 0.5) / places - 0.5) * np.asarray(disc.streak_px)
        cols, rows = (np.flatnonzero(np.abs(axis - middle) <= disc.radius_px + 0.5) for middle in at)
        near = np.s_[:, rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]
        x, y = (axis[cols] - at[0]) / disc.radius_px, (axis[rows] - at[1])[:, None] / disc.radius_px
        sharp[near] += _sharp(x, y, disc.radius_px) / places
    kernel = _kernel(disc.blur_px)
    fine = np.stack([cv2.sepFilter2D(each, -1, kernel, kernel) for each in sharp]).astype(np.float32, copy=False)
    shapes, left, right, above, below = (
        _at_pixels(fine, du, dv) for du, dv in ((0, 0), (-1, 0), (1, 0), (0, -1), (0, 1))
    )
    return Drawn(shapes, np.stack((left - right, above - below), axis=2) * (PER_PX / 2.0))


def _at_pixels(fine: NDArray[np.float32], du: int, dv: int) -> Array:
    """Read the grid off at the pixels' centres, moved by some of its steps (TERMS, n)."""
    rows, cols = (slice(2 * PER_PX + d, fine.shape[1] - 2 * PER_PX + d, PER_PX) for d in (dv, du))
    return fine[:, rows, cols].reshape(TERMS, -1).astype(np.float64)


def plane(half: int) -> Array:
    """Return 1, u and v over a patch (3, n)."""
    span = np.arange(-half, half + 1) / half
    u, v = np.meshgrid(span, span)
    return np.stack((np.ones(u.size), u.ravel(), v.ravel()))


def columns(drawn: Drawn, half: int) -> Array:
    """Return what an image of a ball before a sloping background is made of (n, TERMS + 3)."""
    return np.concatenate((drawn.shapes, (1.0 - drawn.shapes[0]) * plane(half))).T


def _sharp(x: Array, y: Array, radius_px: float) -> Array:
    """Return the shapes (TERMS, h, w) before any blur; x, y in units of the radius."""
    distance = np.hypot(x, y)
    disc = np.clip((1.0 - distance) * radius_px * PER_PX + 0.5, 0.0, 1.0)
    shrink = 1.0 / np.maximum(1.0, distance)
    x, y = x * shrink, y * shrink
    z = np.sqrt(np.maximum(0.0, 1.0 - x * x - y * y))
    return np.stack([disc * term for term in (np.ones_like(z), x + 0.0 * y, y + 0.0 * x, z, x * y, x * x - y * y)])


def _kernel(blur_px: float) -> Array:
    """Return the blur of pixel and lens along one axis of the grid."""
    box = np.ones(PER_PX) / PER_PX
    sigma = blur_px * PER_PX
    if sigma < 0.3:
        return box
    count = math.ceil(4.0 * sigma)
    lens = np.exp(-0.5 * (np.arange(-count, count + 1) / sigma) ** 2)
    return np.convolve(box, lens / lens.sum())
