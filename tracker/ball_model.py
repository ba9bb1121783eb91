"""What a small shaded ball looks like after lens and pixel: radial profiles of its image.

Seen from afar a lit sphere of image radius r is a disc whose brightness is a sum of four shapes on the unit disc:
1, x, y and sqrt(1 - x^2 - y^2), the components of the surface normal (Lambert's law is linear in them). Lens and
pixel blur them with a round kernel, which keeps 1 and sqrt round and leaves x, y their cosine and sine, so each is a
profile over the distance from the centre. The profiles are integrated once per radius and blur and then looked up.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from tracker.types import Array

PIXEL_VARIANCE_PX2 = 1.0 / 12.0  # of a square pixel's own box, along each axis
GRID_STEP_PX = 0.05
REACH_PX = 5.0  # profiles end this far outside the disc
RADIUS_STEP_PX = 0.04
BLUR_STEP_PX = 0.05
_SINE, _SINE_WEIGHT = np.polynomial.legendre.leggauss(20)
_ANGLES = (np.arange(40) + 0.5) * (2.0 * np.pi / 40)


def _nodes() -> tuple[Array, Array]:
    """Return radii (20,) on the unit disc and their weights; rho = sin t takes the root's edge out."""
    t = (_SINE + 1.0) * (np.pi / 4.0)
    rho = np.sin(t)
    return rho, _SINE_WEIGHT * (np.pi / 4.0) * np.cos(t) * rho


@lru_cache(maxsize=512)
def _values(radius_steps: int, blur_steps: int) -> Array:
    """Return the (3, m) profiles of 1, x and sqrt on the distance grid; that of x divided by the distance."""
    radius = radius_steps * RADIUS_STEP_PX
    variance = (blur_steps * BLUR_STEP_PX) ** 2 + PIXEL_VARIANCE_PX2
    rho, weight = _nodes()
    x = radius * np.outer(rho, np.cos(_ANGLES)).ravel()
    y = radius * np.outer(rho, np.sin(_ANGLES)).ravel()
    area = radius**2 * np.repeat(weight, len(_ANGLES)) * (2.0 * np.pi / len(_ANGLES))
    distance = np.arange(0.0, radius + REACH_PX, GRID_STEP_PX)[:, None]
    kernel = np.exp(-((distance - x) ** 2 + y**2) / (2.0 * variance)) / (2.0 * np.pi * variance)
    shapes = np.stack((np.ones_like(x), x / radius, np.sqrt(np.maximum(0.0, 1.0 - (x * x + y * y) / radius**2))))
    profiles = (kernel @ (shapes * area).T).T
    profiles[1, 1:] /= distance[1:, 0]
    profiles[1, 0] = profiles[1, 1]
    return np.asarray(profiles)


@lru_cache(maxsize=512)
def _profiles(radius_steps: int, blur_steps: int) -> Array:
    """Return (9, m): the profiles, their slopes by the distance, their slopes by the blur."""
    here = _values(radius_steps, blur_steps)
    by_blur = (_values(radius_steps, blur_steps + 1) - _values(radius_steps, blur_steps - 1)) / (2.0 * BLUR_STEP_PX)
    profiles = np.concatenate((here, np.gradient(here, GRID_STEP_PX, axis=1), by_blur))
    profiles.flags.writeable = False
    return profiles


def ball_image(dx: Array, dy: Array, radius_px: float, blur_px: float) -> Array:
    """Return the four shapes at pixels (n,) away from the centre by dx, dy [px], and their slopes.

    Returns:
        (4, 4, n): first index value, slope by dx, slope by dy, slope by the blur [1/px]; second index the shape:
        coverage in 0..1, then the blurred x, y and sqrt(1 - x^2 - y^2).
    """
    profiles = _profiles(round(radius_px / RADIUS_STEP_PX), max(1, round(blur_px / BLUR_STEP_PX)))
    distance = np.sqrt(dx * dx + dy * dy) + 1e-9
    place = np.minimum(distance / GRID_STEP_PX, profiles.shape[1] - 1.001)
    left = place.astype(np.intp)
    at_left = profiles[:, left]
    disc, side, dome, disc_d, side_d, dome_d, disc_b, side_b, dome_b = at_left + (place - left) * (
        profiles[:, left + 1] - at_left
    )
    c, s = dx / distance, dy / distance
    out = np.empty((4, 4, len(dx)))
    out[0] = disc, side * dx, side * dy, dome
    out[1] = disc_d * c, side + side_d * dx * c, side_d * dy * c, dome_d * c
    out[2] = disc_d * s, side_d * dx * s, side + side_d * dy * s, dome_d * s
    out[3] = disc_b, side_b * dx, side_b * dy, dome_b
    return out
