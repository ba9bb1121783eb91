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

FREEDOM = 18.0  # of the noise's scale: 7 in rooms with all kinds of trouble, 24 and more where there is none


@compiled("f8(f8[:, ::1], f8[::1], f8[:, ::1])")
def spread(R: Array, u: Array, inverse: Array) -> float:
    """Return by how much more the variances of a pose are than its filter's, as its images contradict each other.

    Args:
        R: (m, m), m >= 2n, covariance of the sightings, whatever follows them left out.
        u, inverse: (2n,) and (2n, 2n), S^-1 y and S^-1 of their innovations.
    Source: what the update leaves of the innovations is R u, which weighs u' R u and should weigh tr R S^-1. Noise of
        another scale in each round, as where a ball is half hidden or JPEG blurs it, makes Student's t of the error:
        its covariance goes by (FREEDOM + u' R u) / (FREEDOM + tr R S^-1); Roth, Ozkan, Gustafsson, "A Student's t
        filter for heavy tailed process and measurement noise", ICASSP (2013). No pose is surer here because its images
        agree, maybe by chance.
    """
    left, due = 0.0, 0.0
    for i in range(len(u)):
        for j in range(len(u)):
            left += u[i] * R[i, j] * u[j]
            due += R[i, j] * inverse[i, j]
    return max(1.0, (FREEDOM + left) / (FREEDOM + due))


@compiled("Tuple((f8[::1], f8[:, ::1], f8[:, ::1], f8))(f8[::1], f8[:, ::1], f8, f8[:, ::1], f8[:, ::1], f8[::1],"
          " f8[:, ::1], f8[:, ::1], i8[::1], f8[::1], f8[:, ::1])")  # fmt: skip
def settled(
    mean: Array, P_prior: Array, dt: float, H: Array, R: Array, dx: Array, P: Array, noise: Array, cameras: Indices,
    u: Array, inverse: Array,
) -> tuple[Array, Array, Array, float]:  # fmt: skip
    """Return mean, covariance and the cameras' noise after an update, and how much less sure its images make it.

    Args:
        mean, P_prior, dt, H, dx, P: as `taught` takes them; P is about the prior's attitude.
        noise, cameras, u, inverse: as `learned` takes them.  R: as `spread` does.

    Source: the error about the new mean is G d, see `moved_slope`.
    """
    dx, P = taught(mean, P_prior, dt, H, dx, P)
    E, J_r = np.empty((3, 3)), np.empty((3, 3))
    now = moved(mean, dx, E, J_r)
    turn = moved_slope(mean, now, E, J_r, len(P))
    after = propagated(turn, P, np.zeros(P.shape))
    return now, after, learned(noise, cameras, u, inverse), spread(R, u, inverse)
