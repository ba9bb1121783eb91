"""A small shaded ball as lens and pixel show it, drawn on a fine grid.

Seen from afar a matt sphere of image radius r is a disc whose brightness depends on its normal alone,
n = (x, y, z) with x right, y down in units of r and z = sqrt(1 - x^2 - y^2) towards the camera. Its image is a sum of
seven matt terms: 1, n, and n where the lamp reaches it (Lambert's law: max(0, n.L) = n.L there, 0 elsewhere), and of
the paint's gloss: the lamp's mirror image, so small that its place tells all. Lens and pixel blur each.
"""

from __future__ import annotations

import math
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
GLOSS_SQUARINGS = 5  # to the power of 32, about that of satin paint; Blinn, "Models of light reflection", SIGGRAPH 1977
COARSE_PER_PX = 4  # of the grid that is blurred; the finer one lies between its points
SMALL_PX = 6.0  # discs below this radius are read off a grid twice as fine
HALF_WAY = np.array([3, -25, 150, 150, -25, 3], dtype=np.float32) / np.float32(256.0)
"""Lagrange's weights for the point between the middle two of six."""

Fine = NDArray[np.float32]


def drawn(radius_px: float, blur_px: float, box_px: int, lamp: Array, weights: Array) -> tuple[Fine, int]:
    """Return shapes (size, size, p), rows are v, with an empty border, and how many grid points make a pixel.

    Args:
        blur_px: one sigma of the lens's round kernel.  box_px: side of the square that gathers light.
        lamp (3,): towards the lamp, in the ray's frame.  weights (p, TERMS + 1): of each shape's terms.
    """
    kernel = _kernel(blur_px, box_px)
    sharp = _sharp(COARSE_PER_PX, radius_px, len(kernel) // 2 + 1, lamp, weights)
    blurred: Fine = cv2.sepFilter2D(sharp, -1, kernel, kernel, borderType=cv2.BORDER_CONSTANT).reshape(sharp.shape)
    if radius_px >= SMALL_PX:
        return blurred, COARSE_PER_PX
    return _twice_as_fine(blurred, HALF_WAY), 2 * COARSE_PER_PX


@lru_cache(maxsize=256)
def _kernel(blur_px: float, box_px: int) -> Fine:
    """Return the lens's and the pixel's blur along one axis of the coarse grid.

    A box of n + 1 samples with its ends at half weight is n wide and stays on the grid; its variance is 1/6 more than
    n^2 / 12, and the ramp at the edge of a sharp disc has 1/12: both are taken off the lens's.
    """
    n = COARSE_PER_PX
    box = np.ones(box_px * n + 1) / (box_px * n)
    box[[0, -1]] /= 2.0
    variance = (blur_px * n) ** 2 - 1.0 / 4.0
    if variance < 0.1:
        return box.astype(np.float32)
    sigma = math.sqrt(variance)
    count = math.ceil(4.0 * sigma)
    lens = np.exp(-0.5 * (np.arange(-count, count + 1) / sigma) ** 2)
    return np.convolve(box, lens / lens.sum()).astype(np.float32)


@compiled("f8(f8, f8)")
def _height(distance: float, step: float) -> float:
    """Return the mean z of a grid point's surroundings, which at the limb falls faster than the grid's step."""
    if distance < 1.0 - 4.0 * step:
        return float(np.sqrt(1.0 - distance * distance))
    total = 0.0
    for k in range(-2, 3):
        total += np.sqrt(max(0.0, 1.0 - (distance + k * step / 5.0) ** 2)) / 5.0
    return total


@compiled("f8(f8[::1], f8[::1])")
def _steepness(terms: Array, lamp: Array) -> float:
    """Return how fast n.L changes across the disc, for the width of the lamp's terminator on the grid."""
    z = max(terms[3], 0.1)
    by_x, by_y = lamp[0] - lamp[2] * terms[1] / z, lamp[1] - lamp[2] * terms[2] / z
    return max(0.3, float(np.sqrt(by_x * by_x + by_y * by_y)))


@compiled("f4[:, :, ::1](i8, f8, i8, f8[::1], f8[:, ::1])")
def _sharp(per_px: int, radius_px: float, border: int, lamp: Array, weights: Array) -> Fine:
    """Return the shapes (size, size, p) before lens and pixel, sharp but for the grid's step, with an empty border."""
    count = int(np.ceil(radius_px * per_px)) + 1 + border
    size = 2 * count + 1
    shapes = np.zeros((size, size, len(weights)), dtype=np.float32)
    step = 1.0 / (per_px * radius_px)
    terms = np.empty(TERMS + 1)
    half = lamp + np.array([0.0, 0.0, 1.0])
    half /= max(np.sqrt(half @ half), 1e-3)
    for row in range(border, size - border):
        y = (row - count) * step
        for column in range(border, size - border):
            x = (column - count) * step
            distance = np.sqrt(x * x + y * y)
            disc = min((1.0 - distance) / step + 0.5, 1.0)
            if disc <= 0.0:
                continue
            shrink = 1.0 / max(1.0, distance)
            terms[0], terms[1], terms[2] = 1.0, x * shrink, y * shrink
            terms[3] = _height(distance, step) / disc
            cosine = lamp[0] * terms[1] + lamp[1] * terms[2] + lamp[2] * terms[3]
            lit = min(1.0, max(0.0, cosine / (step * _steepness(terms, lamp)) + 0.5))
            for i in range(3):
                terms[4 + i] = terms[1 + i] * lit
            gloss = max(half[0] * terms[1] + half[1] * terms[2] + half[2] * terms[3], 0.0)
            for _ in range(GLOSS_SQUARINGS):
                gloss *= gloss
            terms[GLOSS] = gloss
            for k in range(len(weights)):
                total = 0.0
                for i in range(TERMS + 1):
                    total += weights[k, i] * terms[i]
                shapes[row, column, k] = total * disc
    return shapes


@compiled("void(f4[::1], i8, f4[::1], f4[::1])")
def _weigh(values: NDArray[np.float32], step: int, weights: NDArray[np.float32], sums: NDArray[np.float32]) -> None:
    """Fill in sums of six values each, `step` apart; as many as there are values for."""
    a, b, c, d, e, f = weights[0], weights[1], weights[2], weights[3], weights[4], weights[5]
    for i in range(min(len(sums), len(values) - 5 * step)):
        near = c * values[i + 2 * step] + d * values[i + 3 * step]
        sums[i] = near + b * values[i + step] + e * values[i + 4 * step] + a * values[i] + f * values[i + 5 * step]


@compiled("f4[:, :, ::1](Array(f4, 3, 'C', True), f4[::1])")
def _twice_as_fine(coarse: Fine, half_way: NDArray[np.float32]) -> Fine:
    """Return shapes (2 size - 1, 2 size - 1, p) with a point between any two, along each axis by the same weights."""
    size, p = coarse.shape[0], coarse.shape[2]
    fine = np.zeros((2 * size - 1, 2 * size - 1, p), dtype=np.float32)
    before = len(half_way) // 2 - 1
    wide, between = size * p, np.empty(size * p, dtype=np.float32)
    for row in range(size):
        here = coarse[row].copy().reshape(wide)
        _weigh(here, p, half_way, between)
        for column in range(size):
            for k in range(p):
                fine[2 * row, 2 * column, k] = here[column * p + k]
        for column in range(before, size - before - 2):
            for k in range(p):
                fine[2 * row, 2 * column + 1, k] = between[(column - before) * p + k]
    flat = fine.reshape((2 * size - 1) * (2 * size - 1) * p)
    wide = (2 * size - 1) * p
    for row in range(before, size - before - 2):
        first = 2 * (row - before) * wide
        _weigh(flat[first:], 2 * wide, half_way, flat[(2 * row + 1) * wide : (2 * row + 2) * wide])
    return fine
