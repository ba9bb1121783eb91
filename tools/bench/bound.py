"""The least variance that any unbiased estimator can have: the Cramer-Rao bound of a ball's centre, and of a pose.

Source: S. M. Kay, "Fundamentals of Statistical Signal Processing: Estimation Theory", 3.6 to 3.9: with Gaussian noise
    the information of parameters is J' S^-1 J, J the expected image's derivative by them; parameters that are unknown
    but not wanted cost what the wanted ones share with them (the Schur complement).
"""

from __future__ import annotations

import numpy as np

from tracker.types import Array


def parameter_bound(wanted: Array, nuisance: Array) -> Array:
    """Return the bound (a, a) of the wanted parameters' covariance.

    Args:
        wanted (m, a), nuisance (m, q): derivatives of m measurements by the parameters, in units of the noise, which
            is white by then.
    """
    shared = nuisance @ np.linalg.lstsq(nuisance, wanted, rcond=None)[0]
    own = wanted - shared
    return np.asarray(np.linalg.inv(own.T @ own))


def pose_bound(J: Array, bounds_px: Array) -> Array:
    """Return the bound (6, 6) of a pose's errors, position in W [m] and rotation in B [rad].

    Args:
        J: (n, 2, 6) d uv / d error of n ball images.  bounds_px: (n, 2, 2) of their centres [px^2].
    """
    information = J.transpose(0, 2, 1) @ np.linalg.solve(bounds_px, J)
    return np.asarray(np.linalg.inv(information.sum(axis=0)))
