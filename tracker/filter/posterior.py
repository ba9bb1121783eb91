"""The state after an update, put together from what the fit and the filter found, compiled."""

from __future__ import annotations

import numpy as np

from tracker.filter.clocks import taught
from tracker.filter.correction import moved, moved_slope
from tracker.filter.measure import Indices
from tracker.filter.noise import learned
from tracker.maths.compiled import compiled
from tracker.maths.covariance import propagated
from tracker.types import Array


@compiled("Tuple((f8[::1], f8[:, ::1], f8[:, ::1]))(f8[::1], f8[:, ::1], f8, f8[:, ::1], f8[::1], f8[:, ::1],"
          " f8[:, ::1], i8[::1], f8[::1], f8[:, ::1])")  # fmt: skip
def settled(
    mean: Array, P_prior: Array, dt: float, H: Array, dx: Array, P: Array, noise: Array, cameras: Indices, u: Array,
    inverse: Array,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Return mean, covariance and the cameras' noise after an update.

    Args:
        mean, P_prior, dt, H, dx, P: as `taught` takes them; P is about the prior's attitude.
        noise, cameras, u, inverse: as `learned` takes them.

    Source: the error about the new mean is G d, see `moved_slope`.
    """
    dx, P = taught(mean, P_prior, dt, H, dx, P)
    E, J_r = np.empty((3, 3)), np.empty((3, 3))
    now = moved(mean, dx, E, J_r)
    turn = moved_slope(mean, now, E, J_r, len(P))
    after = propagated(turn, P, np.zeros(P.shape))
    return now, after, learned(noise, cameras, u, inverse)
