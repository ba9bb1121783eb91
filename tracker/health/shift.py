"""How a camera's whole picture of the room has moved, by its patches: shifted, turned and zoomed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tracker.maths.compiled import compiled
from tracker.maths.covariance import inverse_of
from tracker.maths.solve import dot
from tracker.types import Array

LEAST_PATCHES = 4
AGREE_PX = 0.5  # a patch that moves otherwise than the picture: something before it, or moved itself
BEND = 0.05  # of a far motion: perspective, which turn and zoom do not make
FAR_OFF_PX = 4.0  # from the median, before turn and zoom are known
STEPS = 3
TURN_SIGMA, ZOOM_SIGMA = 0.01, 0.01  # of what a knock may do, so that few patches in a corner do not tell fables
SHIFT_SIGMA_PX = 100.0
TERMS = 4  # of a motion
PRIOR = np.diag(1.0 / np.array([SHIFT_SIGMA_PX, SHIFT_SIGMA_PX, TURN_SIGMA, ZOOM_SIGMA]) ** 2)


@dataclass(frozen=True, slots=True, eq=False)
class Shift:
    """A small similarity of the picture about its middle.

    motion: (4,) along u and v at the middle [px], turn [rad], zoom, as a point at (x, y) from the middle moves by
        (u + zoom x - turn y, v + turn x + zoom y).
    covariance: (4, 4) of it.  patches: that agree on it.
    """

    motion: Array
    covariance: Array
    patches: int

    def at(self, xy_px: Array) -> Array:
        """Return how far points (n, 2) from the middle have moved (n, 2) [px]."""
        u, v, turn, zoom = self.motion.tolist()
        x, y = xy_px.T
        return np.stack((u + zoom * x - turn * y, v + turn * x + zoom * y), axis=1)

    def sigmas_at(self, xy_px: Array) -> Array:
        """Return one sigma (n,) of that [px]."""
        slopes = _slopes(xy_px)
        return np.asarray(np.sqrt(((slopes @ self.covariance) * slopes).sum(axis=1).reshape(-1, 2).max(axis=1)))


def find_shift(xy_px: Array, moved_px: Array, sigma_px: Array) -> Shift | None:
    """Find the motion that most patches share, None where there is no such.

    Args:
        xy_px: (n, 2) where the patches stood from the picture's middle.  moved_px: (n, 2) how far they moved.
        sigma_px: (n,) of that.
    Source: least squares on those that agree, found by starting from the median and leaving out, in STEPS, what does
        not follow. More than half must agree, or it is not the room that moves.
    """
    if len(xy_px) < LEAST_PATCHES:
        return None
    motion, covariance = np.zeros(TERMS), np.zeros((TERMS, TERMS))
    count = _agreed(_slopes(xy_px), moved_px.reshape(-1), sigma_px, motion, covariance)
    return Shift(motion, covariance, count) if count else None


@compiled("f8[:, ::1](f8[:, ::1])")
def _slopes(xy_px: Array) -> Array:
    """Return d moved / d motion (2n, 4), u and v of each point in turn."""
    slopes = np.zeros((2 * len(xy_px), TERMS))
    for i in range(len(xy_px)):
        x, y = xy_px[i, 0], xy_px[i, 1]
        slopes[2 * i, 0], slopes[2 * i, 2], slopes[2 * i, 3] = 1.0, -y, x
        slopes[2 * i + 1, 1], slopes[2 * i + 1, 2], slopes[2 * i + 1, 3] = 1.0, x, y
    return slopes


@compiled("f8[:, ::1](f8[:, ::1], f8[::1], f8[::1], f8[::1])")
def _fitted(slopes: Array, moved_px: Array, weight: Array, motion: Array) -> Array:
    """Fill in the motion (4,) that fits points best; return its covariance (4, 4). moved_px, weight (2n,): of each."""
    information, target = PRIOR.copy(), np.zeros(TERMS)
    for i in range(len(weight)):
        for j in range(TERMS):
            weighed = weight[i] * slopes[i, j]
            target[j] += weighed * moved_px[i]
            for k in range(TERMS):
                information[j, k] += weighed * slopes[i, k]
    covariance = inverse_of(information)
    for j in range(TERMS):
        motion[j] = dot(covariance[j], target)
    return covariance


@compiled("i8(f8[:, ::1], f8[::1], f8[::1], f8[::1], f8[:, ::1])")
def _agreed(slopes: Array, moved_px: Array, sigma_px: Array, motion: Array, covariance: Array) -> int:
    """Fill in the motion (4,) that most patches share, and its covariance (4, 4); return how many, 0 for no such.

    slopes (2n, 4), moved_px (2n,): u and v of each patch in turn.  sigma_px (n,).
    """
    n, count, squares = len(sigma_px), 0, 0.0
    middle_u, middle_v = np.median(moved_px[::2]), np.median(moved_px[1::2])
    bend_px, rest_px = BEND * math.hypot(middle_u, middle_v), moved_px.copy()
    for i in range(n):
        rest_px[2 * i] -= middle_u
        rest_px[2 * i + 1] -= middle_v
    for step in range(STEPS):
        weight, count = np.zeros(2 * n), 0
        for i in range(n):
            enough_px = FAR_OFF_PX if step == 0 else AGREE_PX + bend_px + 3.0 * sigma_px[i]
            if math.hypot(rest_px[2 * i], rest_px[2 * i + 1]) <= enough_px:
                weight[2 * i], weight[2 * i + 1], count = sigma_px[i] ** -2, sigma_px[i] ** -2, count + 1
        if count < LEAST_PATCHES or 2 * count <= n:
            return 0
        covariance[:], squares = _fitted(slopes, moved_px, weight, motion), 0.0
        for i in range(2 * n):
            rest_px[i] = moved_px[i] - dot(slopes[i], motion)
            squares += weight[i] * rest_px[i] ** 2
    covariance *= max(1.0, squares / (2 * count - TERMS))
    return count
