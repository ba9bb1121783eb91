"""What a small shaded ball looks like after lens and pixel, at any sub-pixel place.

Drawn once per radius, blur and light on a fine grid, the image at any place is a slice.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tracker.compiled import compiled
from tracker.disc import TERMS, drawn
from tracker.types import Array

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


@lru_cache(maxsize=DRAWN)
def _draw(radius_steps: int, blur_steps: int, box_px: int, shades: Shades) -> Template:
    """Draw the shapes of a ball of a rounded radius and blur."""
    radius_px, lamp, weights = radius_steps * RADIUS_STEP_PX, np.array(shades.lamp), np.array(shades.weights)
    fine, per_px = drawn(radius_px, blur_steps * BLUR_STEP_PX, box_px, lamp, weights)
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
