"""What a small shaded ball looks like after lens and pixel, finely sampled.

Seen from afar a matt sphere of image radius r is a disc whose brightness depends on its normal alone,
n = (x, y, z) with x right, y down in units of r and z = sqrt(1 - x^2 - y^2) towards the camera. Its image is a sum of
seven terms: 1, n, and n where the lamp reaches it (Lambert's law: max(0, n.L) = n.L there, 0 elsewhere). Lens and
pixel blur each. Drawn once per radius, blur and light on a fine grid, the image at any sub-pixel place is a slice.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.types import Array

TERMS = 7
"""1, x, y, z, and x, y, z again where the lamp shines."""
MARGIN_PX = 3.5  # patch beyond the ball's edge
STREAK_MAX_PX = 8.0  # longer motion blur is treated as this long
RADIUS_STEP_PX = 0.1
BLUR_STEP_PX = 0.05
Vector = tuple[float, float, float]
Streak = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Shades:
    """How a ball is shaded, in the frame of its ray (x right, y down, z towards the camera).

    lamp: unit vector to the lamp.  weights: for each shape its TERMS weights; the first shape is the coverage.
    """

    lamp: Vector
    weights: tuple[tuple[float, ...], ...]


_UNITS = tuple(tuple(float(i == j) for j in range(TERMS)) for i in range(TERMS))
FLAT = Shades((0.0, 0.0, 1.0), _UNITS[:4])
"""A matt ball under light not known: even, and linear in the normal."""


def every_term(lamp: Vector) -> Shades:
    """Return the shades whose shapes are the terms themselves."""
    return Shades(lamp, _UNITS)


@dataclass(frozen=True, slots=True, eq=False)
class Template:
    """Shapes and their slopes by the centre's u and v and by the radius, on a grid of 1 / per_px pixel.

    fine: (4, p, size, size): value, slope by u, by v, by the radius; then the shape; rows are v, columns u.
    reach: the grid runs from -reach to reach pixels round the centre.  radius_px: of the ball drawn.
    """

    fine: NDArray[np.float32]
    per_px: int
    reach: int
    radius_px: float

    def at(self, u_steps: int, v_steps: int, half: int) -> NDArray[np.float32]:
        """Return (4, p, m, m), m = 2 half + 1: the shapes at the pixels round a centre at (u, v) / per_px."""
        n = self.per_px
        left, top = (self.reach - half) * n - u_steps, (self.reach - half) * n - v_steps
        span = 2 * half * n + 1
        return self.fine[:, :, top : top + span : n, left : left + span : n]


def template_of(radius_px: float, blur_px: float, shades: Shades, reach: int) -> Template:
    """Return the template of a ball; blur_px is one sigma of the lens's round kernel, the pixel's box comes on top."""
    return _draw(round(radius_px / RADIUS_STEP_PX), round(blur_px / BLUR_STEP_PX), shades, reach)


@lru_cache(maxsize=256)
def _draw(radius_steps: int, blur_steps: int, shades: Shades, reach: int) -> Template:
    """Draw the shapes of a ball of a rounded radius and blur.

    The slope by the radius is that of a picture blown up about its centre, blur included, which a percent more radius
    does not show: d/dr = -(x d/dx + y d/dy) / r.
    """
    radius_px, blur_px = radius_steps * RADIUS_STEP_PX, blur_steps * BLUR_STEP_PX
    per_px = 8 if radius_px < 6.0 else 4
    axis = (np.arange(-reach * per_px, reach * per_px + 1) / per_px).astype(np.float32)
    kernel = _kernel(per_px, blur_px)
    fine = np.empty((4, len(shades.weights), len(axis), len(axis)), dtype=np.float32)
    for k, sharp in enumerate(_sharp(per_px, radius_px, shades)):
        border = (len(axis) - len(sharp)) // 2
        padded = cv2.copyMakeBorder(sharp, border, border, border, border, cv2.BORDER_CONSTANT, value=(0.0,))
        value = fine[0, k] = cv2.sepFilter2D(padded, -1, kernel, kernel, borderType=cv2.BORDER_CONSTANT)
        fine[1, k] = -np.gradient(value, np.float32(1.0 / per_px), axis=1)
        fine[2, k] = -np.gradient(value, np.float32(1.0 / per_px), axis=0)
    fine[3] = (axis * fine[1] + axis[:, None] * fine[2]) / radius_px
    fine.flags.writeable = False
    return Template(fine, per_px, reach, radius_px)


def _sharp(per_px: int, radius_px: float, shades: Shades) -> NDArray[np.float32]:
    """Return the shapes (p, size, size) before lens and pixel, just round the disc, sharp but for the grid's step."""
    count = int(np.ceil(radius_px * per_px)) + 1
    axis = np.arange(-count, count + 1) / (per_px * radius_px)
    x, y = (a.ravel() for a in np.broadcast_arrays(axis[None, :], axis[:, None]))
    distance = np.hypot(x, y)
    step = float(axis[1] - axis[0])
    disc = np.clip((1.0 - distance) / step + 0.5, 0.0, 1.0)
    shrink = 1.0 / np.maximum(1.0, distance)
    normal = np.stack((x * shrink, y * shrink, np.sqrt(np.maximum(0.0, 1.0 - distance * distance))))
    lit = np.clip(np.asarray(shades.lamp) @ normal / step + 0.5, 0.0, 1.0)
    terms = np.concatenate((np.ones((1, x.size)), normal, normal * lit)) * disc
    shapes = np.asarray(shades.weights, dtype=np.float64) @ terms
    return np.asarray(shapes.reshape(-1, len(axis), len(axis)), dtype=np.float32)


def _kernel(per_px: int, blur_px: float) -> NDArray[np.float32]:
    """Return the lens's and the pixel's blur along one axis of the grid."""
    # A box of per_px + 1 samples with its ends at half weight is per_px wide and stays on the grid.
    box = np.ones(per_px + 1) / per_px
    box[[0, -1]] /= 2.0
    sigma = blur_px * per_px
    if sigma < 0.3:
        return box.astype(np.float32)
    count = int(np.ceil(4.0 * sigma))
    lens = np.exp(-0.5 * (np.arange(-count, count + 1) / sigma) ** 2)
    return np.convolve(box, lens / lens.sum()).astype(np.float32)


def sample(
    radius_px: float, blur_px: float, shades: Shades, centre: tuple[float, float], half: int, streak_px: Streak
) -> tuple[Array, Array]:
    """Draw a ball's shapes at the template's grid point nearest a centre, smeared along a streak.

    Args:
        radius_px, blur_px, shades: of the ball.
        centre: (u, v) from the patch's middle pixel [px].
        half: the patch is (2 half + 1) pixels square.
        streak_px: how far the ball moves during the exposure [px].
    Returns:
        centre (2,): the grid point, at most half a step off [px].
        shapes (3, p, m, m): value, slope by u, slope by v.
    """
    length = float(np.hypot(*streak_px))
    shrink = min(1.0, STREAK_MAX_PX / length) if length > 0.0 else 0.0
    count = int(np.ceil(2.0 * length * shrink)) | 1
    template = template_of(radius_px, blur_px, shades, half + 2 + (0 if count == 1 else round(STREAK_MAX_PX / 2.0)))
    n = template.per_px
    limit = 3 * n // 2  # a centre further from the middle pixel has run away
    ku, kv = (max(-limit, min(limit, round(c * n))) for c in centre)
    total: NDArray[np.float32] = template.at(ku, kv, half)
    if count > 1:
        places = [((k + 0.5) / count - 0.5) * shrink for k in range(count)]
        smears = [template.at(ku + round(t * streak_px[0] * n), kv + round(t * streak_px[1] * n), half) for t in places]
        total = np.sum(smears, axis=0) / np.float32(count)
    shapes = np.asarray(total[:3], dtype=np.float64)
    shapes[0] += (radius_px - template.radius_px) * total[3]
    return np.array([ku / n, kv / n]), shapes
