"""The state after an update, put together from what the fit and the filter found, compiled."""

from __future__ import annotations

import numpy as np

from tracker.compiled import compiled
from tracker.correction import innovation_covariance, moved
from tracker.measure import Indices
from tracker.noise import learned
from tracker.types import Array


@compiled("Tuple((f8[::1], f8[:, ::1], f8[:, ::1]))(f8[::1], f8[::1], f8[:, ::1], f8[:, ::1],"
          " i8[::1], f8[::1], f8[:, ::1])")  # fmt: skip
def settled(
    mean: Array, dx: Array, P: Array, noise: Array, cameras: Indices, u: Array, inverse: Array
) -> tuple[Array, Array, Array]:
    """Return mean, covariance and the cameras' noise after an update.

    Args:
        mean, dx: the prior's, and the error found.  P: after the update, about the prior's attitude.
        noise, cameras, u, inverse: as `learned` takes them.

    Source: exp(theta + d) = exp(theta) exp(J_r(theta) d), so the error about the new attitude is J_r d.
    """
    E, J_r, turn = np.empty((3, 3)), np.empty((3, 3)), np.eye(len(P))
    now = moved(mean, dx, E, J_r)
    turn[3:6, 3:6] = J_r
    after = innovation_covariance(turn, P, np.zeros(P.shape))
    return now, after, learned(noise, cameras, u, inverse)
