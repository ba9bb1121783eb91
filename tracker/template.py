"""What a small shaded ball looks like after lens and pixel, finely sampled.

Seen from afar a matt sphere of image radius r is a disc whose brightness depends on its normal alone,
n = (x, y, z) with x right, y down in units of r and z = sqrt(1 - x^2 - y^2) towards the camera. Its image is a sum of
seven matt terms: 1, n, and n where the lamp reaches it (Lambert's law: max(0, n.L) = n.L there, 0 elsewhere), and of
the paint's gloss: the lamp's mirror image, so small that its place tells all. Lens and pixel blur each. Drawn once per
radius, blur and light on a fine grid, the image at any sub-pixel place is a slice.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.compiled import compiled
from tracker.types import Array

TERMS = 7
"""1, x, y, z, and x, y, z again where the lamp shines."""
GLOSS = TERMS
"""The term after those: the lamp's mirror image."""
GLOSS_SQUARINGS = 5  # an exponent of 32, about that of satin paint; Blinn, "Models of light reflection", SIGGRAPH 1977
MARGIN_PX = 2.5  # patch beyond the ball's edge
STREAK_MAX_PX = 12.0  # longer motion blur is treated as this long
RADIUS_STEP_PX = 0.1
BLUR_STEP_PX = 0.05
DRAWN = 1024  # templates kept, of about 100 kB each: what a flight through a room shows of all balls, and lessons try
Vector = tuple[float, float, float]
Streak = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Shades:
    """How a ball is shaded, in the frame of its ray (x right, y down, z towards the camera).

    lamp: unit vector to the lamp.  weights: for each shape those of its terms; the first shape is the coverage.
    """

    lamp: Vector
    weights: tuple[tuple[float, ...], ...]


_UNITS = tuple(tuple(float(i == j) for j in range(TERMS + 1)) for i in range(TERMS + 1))
FLAT = Shades((0.0, 0.0, 1.0), _UNITS[:4])
"""A matt ball under light not known: even, and linear in the normal."""


def every_term(lamp: Vector) -> Shades:
    """Return the shades whose shapes are the terms themselves."""
    return Shades(lamp, _UNITS)


@dataclass(frozen=True, slots=True, eq=False)
class Template:
    """Shapes on a grid of 1 / per_px pixel.

    fine: (size, size, p), rows are v; the ball's centre is in the middle, the rim and all beyond it empty.
    radius_px: of the ball drawn.
    """

    fine: NDArray[np.float32]
    per_px: int
    radius_px: float


def template_for(radius_px: float, blur_px: float, shades: Shades, box_px: int = 1) -> Template:
    """Return the template of a ball.

    blur_px: one sigma of the lens's round kernel.  box_px: side of the square that gathers light: a pixel, or a block.
    """
    return _draw(round(radius_px / RADIUS_STEP_PX), round(blur_px / BLUR_STEP_PX), box_px, shades)


def places_along(streak_px: Streak, per_px: int) -> NDArray[np.int64]:
    """Return where along a streak the ball is drawn (k, 2): steps in u and v from its middle [1/per_px px]."""
    return _places(round(streak_px[0] * per_px), round(streak_px[1] * per_px), per_px)


@lru_cache(maxsize=4096)
def _places(u_steps: int, v_steps: int, per_px: int) -> NDArray[np.int64]:
    length = math.hypot(u_steps, v_steps) / per_px
    shrink = min(1.0, STREAK_MAX_PX / length) if length > 0.0 else 0.0
    count = math.ceil(2.0 * length * shrink) | 1
    along = ((np.arange(count) + 0.5) / count - 0.5) * shrink
    places: NDArray[np.int64] = np.rint(along[:, None] * np.array((u_steps, v_steps))).astype(np.int64)
    return places


@compiled("f4[:, :, ::1](i8, f8, i8, f8[::1], f8[:, ::1])")
def _sharp(per_px: int, radius_px: float, count: int, lamp: Array, weights: Array) -> NDArray[np.float32]:
    """Return the shapes before lens and pixel, sharp but for the grid's step: (size, size, p), size = 2 count + 1."""
    size = 2 * count + 1
    shapes = np.zeros((size, size, len(weights)), dtype=np.float32)
    step = 1.0 / (per_px * radius_px)
    terms = np.empty(TERMS + 1)
    half = lamp + np.array([0.0, 0.0, 1.0])
    half /= max(np.sqrt(half @ half), 1e-3)
    rim = min(count, int(np.ceil(radius_px * per_px)) + 1)
    for row in range(count - rim, count + rim + 1):
        y = (row - count) * step
        for column in range(count - rim, count + rim + 1):
            x = (column - count) * step
            distance = np.sqrt(x * x + y * y)
            disc = min((1.0 - distance) / step + 0.5, 1.0)
            if disc <= 0.0:
                continue
            shrink = 1.0 / max(1.0, distance)
            terms[0], terms[1], terms[2] = 1.0, x * shrink, y * shrink
            terms[3] = np.sqrt(max(0.0, 1.0 - distance * distance))
            cosine = lamp[0] * terms[1] + lamp[1] * terms[2] + lamp[2] * terms[3]
            lit = min(1.0, max(0.0, cosine / step + 0.5))
            for i in range(3):
                terms[4 + i] = terms[1 + i] * lit
            terms[GLOSS] = max(half[0] * terms[1] + half[1] * terms[2] + half[2] * terms[3], 0.0)
            for _ in range(GLOSS_SQUARINGS):
                terms[GLOSS] *= terms[GLOSS]
            for k in range(len(weights)):
                total = 0.0
                for i in range(TERMS + 1):
                    total += weights[k, i] * terms[i]
                shapes[row, column, k] = total * disc
    return shapes


@lru_cache(maxsize=256)
def _kernel(per_px: int, blur_steps: int, box_px: int) -> NDArray[np.float32]:
    """Return the lens's and the pixel's blur along one axis of the grid."""
    # A box of n + 1 samples with its ends at half weight is n wide and stays on the grid.
    box = np.ones(box_px * per_px + 1) / (box_px * per_px)
    box[[0, -1]] /= 2.0
    sigma = blur_steps * BLUR_STEP_PX * per_px
    if sigma < 0.3:
        return box.astype(np.float32)
    count = int(np.ceil(4.0 * sigma))
    lens = np.exp(-0.5 * (np.arange(-count, count + 1) / sigma) ** 2)
    return np.convolve(box, lens / lens.sum()).astype(np.float32)


@lru_cache(maxsize=DRAWN)
def _draw(radius_steps: int, blur_steps: int, box_px: int, shades: Shades) -> Template:
    """Draw the shapes of a ball of a rounded radius and blur, on a grid just large enough that its rim is empty."""
    radius_px = radius_steps * RADIUS_STEP_PX
    per_px = 8 if radius_px < 6.0 else 4
    kernel = _kernel(per_px, blur_steps, box_px)
    count = math.ceil(radius_px * per_px) + len(kernel) // 2 + 2
    drawn = _sharp(per_px, radius_px, count, np.array(shades.lamp), np.array(shades.weights))
    blurred = cv2.sepFilter2D(drawn, -1, kernel, kernel, borderType=cv2.BORDER_CONSTANT)
    fine = blurred.astype(np.float32, copy=False).reshape(drawn.shape)  # OpenCV drops a single channel's axis
    fine.flags.writeable = False
    return Template(fine, per_px, radius_px)


@compiled(
    "void(Array(float32, 3, 'C', True), i8, f8, f8, i8, i8, i8[:, ::1], f8[:, ::1],f8[:, ::1], f8[:, ::1], f8[:, ::1])"
)
def read(
    fine: NDArray[np.float32],
    per_px: int,
    drawn_px: float,
    radius_px: float,
    u_steps: int,
    v_steps: int,
    places: NDArray[np.int64],
    pixels: Array,
    value: Array,
    by_u: Array,
    by_v: Array,
) -> None:
    """Read a template off for a centre at (u_steps, v_steps) / per_px from a patch's middle, smeared along a streak.

    Args:
        fine, per_px, drawn_px: of the template.
        radius_px: the ball's, which drawn_px is rounded from; the rest is put right by the slope of a picture blown
            up about its centre, d/dr = (x d/du + y d/dv) / r, since d/du = -d/dx; the blur grows with it, by a
            percent.
        places (k, 2): of the ball along its streak, see `places_along`.
        pixels (..., n): the patch, x and y in its first rows.
        value, by_u, by_v (p, n): the shapes, and their slopes by the centre's u and v [1/px], to be filled in.
    """
    shapes, size, middle = len(value), len(fine), len(fine) // 2
    mean = 1.0 / len(places)
    slope = mean * per_px / 2.0
    share = (radius_px - drawn_px) / drawn_px
    at_u, at_v = u_steps / per_px, v_steps / per_px
    flat, along, below = fine.reshape(size * size * shapes), shapes, size * shapes
    for i in range(pixels.shape[1]):
        x, y = pixels[0, i], pixels[1, i]
        column, row = middle - u_steps + int(x * per_px), middle - v_steps + int(y * per_px)
        for p in range(shapes):
            here = across = down = 0.0
            for k in range(len(places)):
                c, r = column - places[k, 0], row - places[k, 1]
                if 0 < c < size - 1 and 0 < r < size - 1:
                    at = r * below + c * along + p
                    here += flat[at]
                    across += flat[at - along] - flat[at + along]
                    down += flat[at - below] - flat[at + below]
            by_u[p, i], by_v[p, i] = across * slope, down * slope
            value[p, i] = here * mean + share * ((x - at_u) * by_u[p, i] + (y - at_v) * by_v[p, i])
