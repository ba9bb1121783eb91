"""What each camera adds to the noise of its fits: lens, calibration, all that a single image cannot know.

A pair of cameras measures 12 numbers of 6 unknowns, so what the fits' own covariances leave unexplained shows, round
after round. Each camera has one variance f beside its fits' own covariance.

Source: score and Fisher information of a variance component, Patterson and Thompson, "Recovery of inter-block
    information", Biometrika 58 (1971): for innovations y of covariance S with dS/df = I on the camera's rows and
    u = S^-1 y, score = (|u|^2 - tr S^-1) / 2 (1), information = |S^-1|_F^2 / 2 (2), both over those rows. Old rounds
    fade; a sighting that fits badly counts no more than LIMIT (Huber).
"""

from __future__ import annotations

import numpy as np

from tracker.filter.measure import Indices
from tracker.maths.compiled import compiled
from tracker.types import Array

LEAST_PX = 0.01
MEMORY = 300.0  # rounds
PRIOR_PIXELS = 24.0  # the config's value weighs as much as so many exact pixels
LIMIT = 9.0  # of a sighting's squared Mahalanobis distance, 2 degrees of freedom


def start_noise(cameras: int, sigma_px: float) -> Array:
    """Return `State.noise` (cameras, 2) of a rig just switched on: variance [px^2] and information [px^-4]."""
    variance = sigma_px**2
    return np.tile([variance, PRIOR_PIXELS / (2.0 * variance**2)], (cameras, 1))


def doubted(noise: Array, camera: int, sigma_px: float) -> Array:
    """Return the noise (cameras, 2) of a rig of which one camera has lost its trust."""
    after = noise.copy()
    after[camera] = start_noise(1, sigma_px)[0]
    return after


@compiled("f8[:, ::1](f8[:, ::1], i8[::1], f8[::1], f8[:, ::1])")
def learned(noise: Array, cameras: Indices, u: Array, inverse: Array) -> Array:
    """Return the noise (cameras, 2) after one round.

    Args:
        cameras: (n,) of each sighting.
        u, inverse: (2n,) and (2n, 2n), S^-1 y and S^-1 of the round's innovations.
    """
    after = noise.copy()
    for c in range(len(noise)):
        score, information = 0.0, 0.0
        for s in range(len(cameras)):
            if cameras[s] != c:
                continue
            i = 2 * s
            a, b, d = inverse[i, i], inverse[i, i + 1], inverse[i + 1, i + 1]
            distance2 = (d * u[i] ** 2 - 2.0 * b * u[i] * u[i + 1] + a * u[i + 1] ** 2) / (a * d - b * b)
            weight = min(1.0, LIMIT / distance2) if distance2 > 0.0 else 1.0
            score += (weight * (u[i] ** 2 + u[i + 1] ** 2) - a - d) / 2.0  # (1)
            for r in range(len(cameras)):
                if cameras[r] == c:
                    for k in range(2):
                        for m in range(2):
                            information += inverse[i + k, 2 * r + m] ** 2 / 2.0  # (2)
        if information > 0.0:
            after[c, 1] = (1.0 - 1.0 / MEMORY) * noise[c, 1] + information
            after[c, 0] = max(LEAST_PX**2, noise[c, 0] + score / after[c, 1])
    return after
