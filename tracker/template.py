"""What a small shaded ball looks like after lens and pixel, finely sampled.

Seen from afar a matt sphere of image radius r is a disc whose brightness depends on its normal alone,
n = (x, y, z) with x right, y down in units of r and z = sqrt(1 - x^2 - y^2) towards the camera. Its image is a sum of
seven terms: 1, n, and n where the lamp reaches it (Lambert's law: max(0, n.L) = n.L there, 0 elsewhere). Lens and
pixel blur each. Drawn once per radius, blur and light on a fine grid, the image at any sub-pixel place is a slice.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

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
    """Shapes on a grid of 1 / per_px pixel.

    fine: (p, size, size), rows are v.  reach: the grid runs from -reach to reach pixels round the centre.
    radius_px: of the ball drawn.
    """

    fine: NDArray[np.float32]
    per_px: int
    reach: int
    radius_px: float

    def at(self, u_steps: int, v_steps: int, half: int) -> NDArray[np.float32]:
        """Return (p, m, m), m = 2 half + 1: the shapes at the pixels round a centre at (u, v) / per_px."""
        n = self.per_px
        left, top = (self.reach - half) * n - u_steps, (self.reach - half) * n - v_steps
        span = 2 * half * n + 1
        return self.fine[:, top : top + span : n, left : left + span : n]

    def with_slopes(self, u_steps: int, v_steps: int, half: int) -> NDArray[np.float32]:
        """Return (3, p, m, m): the shapes and their slopes by the centre's u and v [1/px]."""
        drawn = np.empty((3, len(self.fine), 2 * half + 1, 2 * half + 1), dtype=np.float32)
        drawn[0] = self.at(u_steps, v_steps, half)
        np.subtract(self.at(u_steps + 1, v_steps, half), self.at(u_steps - 1, v_steps, half), out=drawn[1])
        np.subtract(self.at(u_steps, v_steps + 1, half), self.at(u_steps, v_steps - 1, half), out=drawn[2])
        drawn[1:] *= np.float32(self.per_px / 2.0)
        return drawn


def template_for(radius_px: float, blur_px: float, shades: Shades, half: int, streak_px: Streak) -> Template:
    """Return the template of a ball, large enough for patches of 2 half + 1 pixels and the ball's streak.

    blur_px: one sigma of the lens's round kernel; the pixel's box comes on top.
    """
    reach = half + 2 + (0 if _smears(streak_px)[0] == 1 else round(STREAK_MAX_PX / 2.0))
    return _draw(round(radius_px / RADIUS_STEP_PX), round(blur_px / BLUR_STEP_PX), shades, reach)


def _smears(streak_px: Streak) -> tuple[int, float]:
    """Return in how many places along a streak the ball is drawn, and by what factor the streak is shortened."""
    length = math.hypot(*streak_px)
    shrink = min(1.0, STREAK_MAX_PX / length) if length > 0.0 else 0.0
    return math.ceil(2.0 * length * shrink) | 1, shrink


@lru_cache(maxsize=256)
def _draw(radius_steps: int, blur_steps: int, shades: Shades, reach: int) -> Template:
    """Draw the shapes of a ball of a rounded radius and blur."""
    radius_px, blur_px = radius_steps * RADIUS_STEP_PX, blur_steps * BLUR_STEP_PX
    per_px = 8 if radius_px < 6.0 else 4
    size = 2 * reach * per_px + 1
    kernel = _kernel(per_px, blur_px)
    fine = np.empty((len(shades.weights), size, size), dtype=np.float32)
    for k, sharp in enumerate(_sharp(per_px, radius_px, shades)):
        border = (size - len(sharp)) // 2
        padded = cv2.copyMakeBorder(sharp, border, border, border, border, cv2.BORDER_CONSTANT, value=(0.0,))
        fine[k] = cv2.sepFilter2D(padded, -1, kernel, kernel, borderType=cv2.BORDER_CONSTANT)
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
    template: Template, radius_px: float, centre: tuple[float, float], half: int, streak_px: Streak
) -> tuple[tuple[float, float], NDArray[np.float32]]:
    """Read a template off at the grid point nearest a centre, smeared along a streak.

    Args:
        radius_px: the ball's, which the template's is rounded from; the rest is put right by the slope of a picture
            blown up about its centre, d/dr = (x d/du + y d/dv) / r, since d/du = -d/dx; the blur grows with it, by a
            percent.
        centre: (u, v) from the patch's middle pixel [px].
        half: the patch is (2 half + 1) pixels square.
        streak_px: how far the ball moves during the exposure [px].
    Returns:
        centre: the grid point, at most half a step off [px].
        shapes (3, p, m, m): value, slope by u, slope by v.
    """
    n = template.per_px
    limit = 3 * n // 2  # a centre further from the middle pixel has run away
    ku, kv = (max(-limit, min(limit, round(c * n))) for c in centre)
    count, shrink = _smears(streak_px)
    if count == 1:
        drawn = template.with_slopes(ku, kv, half)
    else:
        places = [((k + 0.5) / count - 0.5) * shrink * n for k in range(count)]
        smears = [
            template.with_slopes(ku + round(t * streak_px[0]), kv + round(t * streak_px[1]), half) for t in places
        ]
        drawn = np.sum(smears, axis=0) / np.float32(count)
    share = np.float32((radius_px - template.radius_px) / template.radius_px)
    axis = np.arange(-half, half + 1, dtype=np.float32) * share
    u0, v0 = np.float32(ku / n) * share, np.float32(kv / n) * share
    drawn[0] += (axis - u0) * drawn[1] + (axis - v0)[:, None] * drawn[2]
    return (ku / n, kv / n), drawn
