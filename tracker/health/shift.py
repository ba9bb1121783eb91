"""How a camera's whole picture of the room has moved, by its patches: shifted, turned and zoomed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tracker.types import Array

LEAST_PATCHES = 4
AGREE_PX = 0.5  # a patch that moves otherwise than the picture: something before it, or moved itself
BEND = 0.05  # of a far motion: perspective, which turn and zoom do not make
FAR_OFF_PX = 4.0  # from the median, before turn and zoom are known
STEPS = 3
TURN_SIGMA, ZOOM_SIGMA = 0.01, 0.01  # of what a knock may do, so that few patches in a corner do not tell fables
SHIFT_SIGMA_PX = 100.0
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
    slopes, weight = _slopes(xy_px), 1.0 / sigma_px**2
    middle_px = np.median(moved_px, axis=0)
    rest_px = moved_px - middle_px
    enough_px = AGREE_PX + BEND * math.hypot(*middle_px.tolist()) + 3.0 * sigma_px
    for step in range(STEPS):
        off_px = np.hypot(rest_px[:, 0], rest_px[:, 1])
        agree = off_px <= (FAR_OFF_PX if step == 0 else enough_px)
        count = int(agree.sum())
        if count < LEAST_PATCHES or 2 * count <= len(xy_px):
            return None
        w = np.repeat(np.where(agree, weight, 0.0), 2)
        weighed = slopes * w[:, None]
        covariance = np.linalg.inv(weighed.T @ slopes + PRIOR)
        motion = covariance @ (weighed.T @ moved_px.reshape(-1))
        rest_px = moved_px - (slopes @ motion).reshape(-1, 2)
    excess = max(1.0, float(w @ rest_px.reshape(-1) ** 2) / (2 * count - len(motion)))
    return Shift(motion, covariance * excess, count)


def _slopes(xy_px: Array) -> Array:
    """Return d moved / d motion (2n, 4), u and v of each point in turn."""
    slopes = np.zeros((2 * len(xy_px), 4))
    x, y = xy_px.T
    slopes[::2, 0], slopes[::2, 2], slopes[::2, 3] = 1.0, -y, x
    slopes[1::2, 1], slopes[1::2, 2], slopes[1::2, 3] = 1.0, x, y
    return slopes
