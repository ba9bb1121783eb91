"""Small pieces of the room that a camera would know again: chosen once, then looked up in later images."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from tracker.maths.compiled import compiled
from tracker.types import Array, Image

HALF_PX = 8  # of a patch's side
SIDE_PX = 2 * HALF_PX + 1
NEAR_PX, FAR_PX = 4, 48  # how far it is followed from where it is expected, and how far it is searched for
APART_PX = 36  # of patches: they shall not all be covered by one hand
MOST = 10
CORNER_LEVELS2 = 1.0  # least eigenvalue of the mean outer product of the gradient [grey levels^2 / px^2]
NOISE_LEVELS = 2.5  # of a pixel, one sigma
LEAST_SIGMA_PX = 0.03  # that interpolation leaves
ALIKE = 0.7  # least correlation with the image it was cut from: below, something stands before it
STEPS = 5
GREEN = 1  # the channel with the least noise

Motion = tuple[float, float]
"""Along u and v [px]."""


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """One piece of the room.

    u_px, v_px: its middle in the image.  look (17, 17): what it looks like.
    plain (17, 17), fit (4, 17, 17): see `_followed`.  sigma_px: one sigma of where it is found.
    """

    u_px: int
    v_px: int
    look: Image
    plain: Array
    fit: Array
    sigma_px: float

    def followed(self, image: Image, expected: Motion) -> Motion | None:
        """Return how far it stands from where it stood, in an image (h, w, 3); None where it is not about there.

        expected: how far it will have moved.
        """
        u, v, side = self.u_px + round(expected[0]), self.v_px + round(expected[1]), HALF_PX + NEAR_PX + 1
        height, width = image.shape[:2]
        if not (side <= u < width - side and side <= v < height - side):
            return None
        part = np.ascontiguousarray(image[v - side : v + side + 1, u - side : u + side + 1, GREEN])
        across, down, alike = _followed(part, self.plain, self.fit)
        return (across + u - self.u_px, down + v - self.v_px) if alike >= ALIKE else None

    def searched(self, image: Image) -> Motion | None:
        """Return what `followed` does, from as far as FAR_PX."""
        height, width = image.shape[:2]
        left, top = max(self.u_px - HALF_PX - FAR_PX, 0), max(self.v_px - HALF_PX - FAR_PX, 0)
        right, bottom = min(self.u_px + HALF_PX + FAR_PX, width - 1), min(self.v_px + HALF_PX + FAR_PX, height - 1)
        part = np.ascontiguousarray(image[top : bottom + 1, left : right + 1, GREEN])
        likeness = cv2.matchTemplate(part, self.look, cv2.TM_CCOEFF_NORMED)
        _, _, _, (column, row) = cv2.minMaxLoc(likeness)
        return self.followed(image, (left + column + HALF_PX - self.u_px, top + row + HALF_PX - self.v_px))


def choose_patches(image: Image, keep_off_px: Array, off_px: float) -> tuple[Patch, ...]:
    """Choose up to MOST pieces of an image (h, w, 3) that are corners, the sharpest first.

    Args:
        keep_off_px: (n, 2) where things stand that will move [px].  off_px: how far to keep off them [px].
    Source: the smaller eigenvalue of the gradient's second moments; Shi, Tomasi, "Good features to track" (1994).
    """
    grey = np.ascontiguousarray(image[..., GREEN])
    smooth = cv2.GaussianBlur(grey, (0, 0), 1.0)
    corner = cv2.cornerMinEigenVal(smooth, SIDE_PX) * (255.0 / 2.0) ** 2  # OpenCV has slopes of 2 / 255 a level
    rim = HALF_PX + NEAR_PX + 2
    inside = np.zeros_like(corner)
    inside[rim:-rim, rim:-rim] = corner[rim:-rim, rim:-rim]
    for u, v in keep_off_px.tolist():
        cv2.circle(inside, (round(u), round(v)), round(off_px), 0.0, cv2.FILLED)
    patches: list[Patch] = []
    while len(patches) < MOST:
        _, best, _, (u, v) = cv2.minMaxLoc(inside)
        if best < CORNER_LEVELS2:
            break
        patches.append(_cut(grey, u, v, math.hypot(LEAST_SIGMA_PX, NOISE_LEVELS / math.sqrt(best) / SIDE_PX)))
        cv2.circle(inside, (u, v), APART_PX, 0.0, cv2.FILLED)
    return tuple(patches)


def _cut(grey: Image, u: int, v: int, sigma_px: float) -> Patch:
    """Cut a patch out of a grey image (h, w)."""
    wider = grey[v - HALF_PX - 1 : v + HALF_PX + 2, u - HALF_PX - 1 : u + HALF_PX + 2].astype(np.float64)
    plain = wider[1:-1, 1:-1] - wider[1:-1, 1:-1].mean()
    across, down = (wider[1:-1, 2:] - wider[1:-1, :-2]) / 2.0, (wider[2:, 1:-1] - wider[:-2, 1:-1]) / 2.0
    basis = np.stack((plain, np.ones_like(plain), across, down)).reshape(4, -1)
    fit = np.linalg.solve(basis @ basis.T, basis).reshape(4, SIDE_PX, SIDE_PX)
    look = grey[v - HALF_PX : v + HALF_PX + 1, u - HALF_PX : u + HALF_PX + 1].copy()
    return Patch(u, v, look, np.ascontiguousarray(plain), np.ascontiguousarray(fit), sigma_px)


@compiled("UniTuple(f8, 3)(u1[:, ::1], f8[:, ::1], f8[:, :, ::1])")
def _followed(part: Image, plain: Array, fit: Array) -> tuple[float, float, float]:
    """Return how far a patch stands from the middle of a part of an image [px], and its correlation there.

    Args:
        part: (27, 27).  plain: the patch T less its mean.  fit: takes coefficients of T, 1, dT/du and dT/dv from an
            image by least squares.
    Source: at a displacement d that is off by e from the true one the image is a T + b + a e . grad T: the brighter
        or dimmer light a, b and e follow from one linear fit whose equations never change; then d goes on by -e. Baker,
        Matthews, "Lucas-Kanade 20 years on" (2004), inverse compositional.
    """
    across, down, alike, size = 0.0, 0.0, 0.0, len(plain)
    margin = (len(part) - size) // 2
    for step in range(STEPS + 1):
        column, row = math.floor(across), math.floor(down)
        if not (-margin <= column < margin and -margin <= row < margin):
            return across, down, 0.0
        x, y = across - column, down - row
        c0, c2, c3, total, squares, common, own = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(size):
            for j in range(size):
                r, c = i + margin + row, j + margin + column
                above = part[r, c] + x * (float(part[r, c + 1]) - part[r, c])
                below = part[r + 1, c] + x * (float(part[r + 1, c + 1]) - part[r + 1, c])
                value, t = above + y * (below - above), plain[i, j]
                c0, c2, c3 = c0 + fit[0, i, j] * value, c2 + fit[2, i, j] * value, c3 + fit[3, i, j] * value
                total, squares, common, own = total + value, squares + value * value, common + value * t, own + t * t
        alike = common / math.sqrt(max((squares - total * total / (size * size)) * own, 1e-9))
        if step == STEPS or not c0 > 0.0:
            break
        across, down = across - c2 / c0, down - c3 / c0
    return across, down, alike
