"""What a small shaded ball looks like after lens and pixel, finely sampled.

Seen from afar a matt sphere of image radius r is a disc whose brightness depends on its normal alone,
n = (x, y, z) with x right, y down in units of r and z = sqrt(1 - x^2 - y^2) towards the camera. Its image is a sum of
matt terms, functions of n (`tracker/image/harmonics.py`), and of the paint's gloss: the lamp's mirror image, so small
that its place tells all. Lens and pixel blur each. Drawn once per rounded radius, blur and light on a fine grid, the
image at any sub-pixel place is a slice (`tracker/image/reading.py`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.image.harmonics import TERMS, lit
from tracker.maths.compiled import compiled
from tracker.types import Array

GLOSS = TERMS
"""The term after those: the lamp's mirror image."""
GLOSS_SQUARINGS = 5  # an exponent of 32, about that of satin paint; Blinn, "Models of light reflection", SIGGRAPH 1977
MARGIN_PX = 2.5  # patch beyond the ball's edge
STREAK_MAX_PX = 12.0  # longer motion blur is treated as this long
RADIUS_STEP_PX = 0.2
BLUR_STEP_PX = 0.1
FINE, COARSE = 8, 4  # samples per pixel: of a small ball's brightness; of a large one, and of colour by blocks
SMALL_PX = 6.0  # a small ball's radius
DRAWN = 256  # templates kept, of about 100 kB each
Vector = tuple[float, float, float]
Streak = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Shades:
    """How a ball is shaded, in the frame of its ray (x right, y down, z towards the camera).

    lamp: unit vector to where most light comes from.
    weights: for each shape those of its terms; the first shape is the coverage.
    """

    lamp: Vector
    weights: tuple[tuple[float, ...], ...]


TO_CAMERA: Vector = (0.0, 0.0, 1.0)
_UNITS = tuple(tuple(float(i == j) for j in range(TERMS + 1)) for i in range(TERMS + 1))
FLAT = Shades(TO_CAMERA, _UNITS[:4])
"""A matt ball under light not known: even, and linear in the normal."""
EVERY_TERM = Shades(TO_CAMERA, _UNITS[:TERMS])
"""Its shapes are the matt terms themselves."""


def mirrored(lamp: Vector) -> Shades:
    """Return the shades whose only shape is a lamp's mirror image."""
    return Shades(lamp, _UNITS[GLOSS:])


class Template(NamedTuple):  # spread out into compiled calls
    """Shapes on a grid of 1 / per_px pixel.

    fine: (size, size, p), rows are v; the ball's centre is in the middle, the rim and all beyond it empty.
    made: (3,) per_px, the radius drawn [px] and the variance of its blur along one axis [px^2], the box included.
    """

    fine: NDArray[np.float32]
    made: Array


def template_for(radius_px: float, blur_px: float, shades: Shades, box_px: int = 1) -> Template:
    """Return the template of a ball.

    blur_px: one sigma of the lens's round kernel.  box_px: side of the square that gathers light: a pixel, or a block.
    """
    return draw(*steps_of(radius_px, blur_px), box_px, sampling_of(radius_px, box_px), shades)


def steps_of(radius_px: float, blur_px: float) -> tuple[int, int]:
    """Return radius and blur rounded to the steps that templates are drawn in."""
    return round(radius_px / RADIUS_STEP_PX), round(blur_px / BLUR_STEP_PX)


def sampling_of(radius_px: float, box_px: int) -> int:
    """Return the samples per pixel that a ball's image needs."""
    return FINE if box_px == 1 and radius_px < SMALL_PX else COARSE


def variance_of(blur_px: float, box_px: int) -> float:
    """Return the variance along one axis of a lens's blur and a box together [px^2]."""
    return blur_px * blur_px + box_px * box_px / 12.0


@compiled("void(f4, f4, f4, f4[::1], f4[:, ::1], f4[::1], f4[::1])")
def _surface_along(
    y: np.float32, step: np.float32, first: np.float32, half: NDArray[np.float32], normals: NDArray[np.float32],
    gloss: NDArray[np.float32], disc: NDArray[np.float32],
) -> None:  # fmt: skip
    """Fill in normals (3, n) along a row of a sphere's image, its gloss (n,) and how much of each sample is disc (n,).

    y, step, first: the row, the grid's step and the first sample's x, in radii.  half: midway between lamp and camera.
    """
    zero, one = np.float32(0.0), np.float32(1.0)
    for i in range(len(disc)):
        x = first + np.float32(i) * step
        distance = np.sqrt(x * x + y * y)
        disc[i] = max(zero, min((one - distance) / step + np.float32(0.5), one))
        shrink = one / max(one, distance)
        n_x, n_y, n_z = x * shrink, y * shrink, np.sqrt(max(zero, one - distance * distance))
        normals[0, i], normals[1, i], normals[2, i] = n_x, n_y, n_z
        mirrored = max(half[0] * n_x + half[1] * n_y + half[2] * n_z, zero)
        for _ in range(GLOSS_SQUARINGS):
            mirrored *= mirrored
        gloss[i] = mirrored


@compiled("f4[:, ::1](i8, f8, i8, f4[::1], f4[::1])")
def _sharp(
    per_px: int, radius_px: float, count: int, lamp: NDArray[np.float32], weights: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return a shape before lens and pixel, sharp but for the grid's step: (size, size), size = 2 count + 1."""
    size, step = 2 * count + 1, np.float32(1.0 / (per_px * radius_px))
    shape = np.zeros((size, size), np.float32)
    half = lamp + np.array([0.0, 0.0, 1.0], np.float32)
    half /= max(np.sqrt((half * half).sum()), np.float32(1e-3))
    rim = min(count, int(np.ceil(radius_px * per_px)) + 1)
    width = 2 * rim + 1
    normals, rows = np.empty((3, width), np.float32), np.empty((3, width), np.float32)
    gloss, disc, line = rows[0], rows[1], rows[2]
    line[:] = weights[0]
    uneven, shine = weights[1:GLOSS].any(), weights[GLOSS]
    for row in range(count - rim, count + rim + 1):
        _surface_along(np.float32(row - count) * step, step, np.float32(-rim) * step, half, normals, gloss, disc)
        if uneven:
            lit(weights[:GLOSS], normals, line)
        for i in range(width):
            shape[row, count - rim + i] = (line[i] + shine * gloss[i]) * disc[i]
    return shape


@compiled("f4[:, ::1](f4[:, ::1])")
def _thinned(fine: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return every other sample of a picture of odd size about its middle, each with a share of its neighbours."""
    middle = len(fine) // 2
    count = (middle - 1) // 2
    coarse = np.zeros((2 * count + 1, 2 * count + 1), np.float32)
    for row in range(2 * count + 1):
        for column in range(2 * count + 1):
            r, c = middle + 2 * (row - count), middle + 2 * (column - count)
            sides = fine[r - 1, c] + fine[r + 1, c] + fine[r, c - 1] + fine[r, c + 1]
            corners = fine[r - 1, c - 1] + fine[r - 1, c + 1] + fine[r + 1, c - 1] + fine[r + 1, c + 1]
            coarse[row, column] = 0.25 * fine[r, c] + 0.125 * sides + 0.0625 * corners
    return coarse


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
def draw(radius_steps: int, blur_steps: int, box_px: int, per_px: int, shades: Shades) -> Template:
    """Draw the shapes of a ball of a rounded radius and blur, on a grid just large enough that its rim is empty.

    Beside a grid of 32 per pixel, 8 are wrong by 0.5 % of the contrast at most, 4 by 1 % when colour is kept by blocks;
    either moves a centre by less than 0.001 px.
    """
    variance = variance_of(blur_steps * BLUR_STEP_PX, box_px)
    if per_px < sampling_of(radius_steps * RADIUS_STEP_PX, box_px):
        variance += 0.5 / (2 * per_px) ** 2  # of a sample with a quarter on either side
    size, shapes = (radius_steps, blur_steps, box_px, per_px), []
    for weights in shades.weights:
        lamp = shades.lamp if weights[GLOSS] else TO_CAMERA
        shapes.append((_kept_shape if weights in _UNITS else _shape)(*size, lamp, weights))
    fine = cv2.merge(shapes).astype(np.float32, copy=False)
    fine = fine.reshape(*shapes[0].shape, len(shapes))  # OpenCV drops a single channel's axis
    fine.flags.writeable = False
    return Template(fine, np.array((per_px, radius_steps * RADIUS_STEP_PX, variance)))


def _shape(
    radius_steps: int, blur_steps: int, box_px: int, per_px: int, lamp: Vector, weights: tuple[float, ...]
) -> NDArray[np.float32]:
    """Draw one shape (size, size); arguments as for `draw`, its lamp and its weights alone."""
    radius_px, kernel = radius_steps * RADIUS_STEP_PX, _kernel(per_px, blur_steps, box_px)
    count = math.ceil(radius_px * per_px) + len(kernel) // 2 + 2
    form = np.array(lamp, np.float32), np.array(weights, np.float32)
    if per_px < sampling_of(radius_px, box_px):
        sharp = _thinned(_sharp(2 * per_px, radius_px, 2 * count + 1, *form))
    else:
        sharp = _sharp(per_px, radius_px, count, *form)
    blurred = cv2.sepFilter2D(sharp, -1, kernel, kernel, borderType=cv2.BORDER_CONSTANT)
    return blurred.astype(np.float32, copy=False)


_kept_shape = lru_cache(maxsize=DRAWN)(_shape)
"""Of a single term: other light leaves it as it is."""
