"""How far residuals usually go, and how little those count that go much further."""

from __future__ import annotations

import numpy as np

from tools.calibrate.room.scene import Seen
from tracker.types import Array

CAUCHY = 2.4  # sigmas; Holland, Welsch, "Robust regression using iteratively reweighted least squares" (1977)
LEAST_SIGMA_PX = 0.02  # however sharp an image is
NORMAL = 1.4826  # sigmas of a normal distribution in its median absolute deviation


def claimed_px(seen: Seen) -> Array:
    """Return one sigma of each sighting (n,), in the order of `jacobian.residuals`, by its image alone [px]."""
    sigmas = np.concatenate([seen.sigma_px[c, there].reshape(-1) for c, there in enumerate(seen.there)])
    return np.asarray(np.hypot(sigmas, LEAST_SIGMA_PX))


def scale_of(r: Array, claimed: Array) -> float:
    """Return by how much residuals exceed what the images claim: light, compression and lens add to it."""
    return NORMAL * float(np.median(np.abs(r) / np.repeat(claimed, 2)))


def weights_of(r: Array, sigma_px: Array) -> Array:
    """Return the weight of each sighting (n,), by its sigma (n,)."""
    return np.asarray(1.0 / (1.0 + _squared(r, sigma_px) / CAUCHY**2))


def cost_of(r: Array, sigma_px: Array) -> float:
    """Return what `weights_of` are the weights of: twice the negative logarithm of the likelihood."""
    return float(2.0 * CAUCHY**2 * np.log1p(_squared(r, sigma_px) / CAUCHY**2).sum())


def _squared(r: Array, sigma_px: Array) -> Array:
    return np.asarray((r.reshape(-1, 2) ** 2).sum(axis=1) / (2.0 * sigma_px**2))
