"""How a camera's whole picture of the room has moved, by its patches: shifted, turned and zoomed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracker.types import Array

LEAST_PATCHES = 4
AGREE_PX = 0.5  # a patch that moves otherwise than the picture: something before it, or moved itself
FAR_OFF_PX = 4.0  # from the median, before turn and zoom are known
STEPS = 4
TURN_SIGMA, ZOOM_SIGMA = 0.01, 0.01  # of what a knock may do, so that few patches in a corner do not tell fables
SHIFT_SIGMA_PX = 100.0


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

    def at(self, xy_px: Array) -> tuple[Array, Array]:
        """Return how far points (n, 2) from the middle have moved (n, 2), and one sigma of that (n,) [px]."""
        slopes = _slopes(xy_px)
        variances = np.einsum("nij,jk,nik->ni", slopes, self.covariance, slopes).max(axis=1)
        return slopes @ self.motion, np.sqrt(variances)


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
    rest_px = moved_px - np.median(moved_px, axis=0)
    for step in range(STEPS):
        agree = np.linalg.norm(rest_px, axis=1) <= (FAR_OFF_PX if step == 0 else AGREE_PX + 3.0 * sigma_px)
        if agree.sum() < LEAST_PATCHES or 2 * agree.sum() <= len(xy_px):
            return None
        A, w = slopes[agree], weight[agree]
        prior = np.diag(1.0 / np.array([SHIFT_SIGMA_PX, SHIFT_SIGMA_PX, TURN_SIGMA, ZOOM_SIGMA]) ** 2)
        covariance = np.linalg.inv(np.einsum("n,nij,nik->jk", w, A, A) + prior)
        motion = covariance @ np.einsum("n,nij,ni->j", w, A, moved_px[agree])
        rest_px = moved_px - slopes @ motion
    excess = max(1.0, float((w * (rest_px[agree] ** 2).sum(axis=1)).sum()) / (2 * len(w) - len(motion)))
    return Shift(motion, covariance * excess, len(w))


def _slopes(xy_px: Array) -> Array:
    """Return d moved / d motion (n, 2, 4)."""
    x, y = xy_px.T
    one, zero = np.ones_like(x), np.zeros_like(x)
    return np.stack((np.stack((one, zero, -y, x), axis=1), np.stack((zero, one, x, y), axis=1)), axis=1)
