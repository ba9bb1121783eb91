"""What the rays to the balls say of the cameras' stand at one instant.

Source: with r the residuals of the sightings (whitened), J their slope by the vehicle's pose and D that by small
    motions of the cameras, P = I - J (J'J)^-1 J' takes out what another pose would explain. What is left tells of the
    motions c by r ~ D c: information N = D' P D (1), gradient g = D' P r (2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tracker.filter.batch import sighted
from tracker.filter.measure import Indices, camera_table, marker_points, pixels
from tracker.maths.compiled import compiled
from tracker.maths.solve import dot, eliminate
from tracker.rig import Rig
from tracker.state import OFFSETS, State
from tracker.types import Array, BallSighting

LEAST_CLOCK_S = 1e-6
MOTION = 6  # of a camera: its place in W [m], then its turn in W about itself [rad]


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """One instant. N (6 cameras, 6 cameras) and g (6 cameras,), see (1) and (2)."""

    N: Array
    g: Array


@dataclass(frozen=True, slots=True, eq=False)
class Linear:
    """Sightings held against a pose, whitened by their noise.

    r (2n,): residuals.  J (2n, 6), D (2n, 6 cameras): their slopes by the pose's error and by motions of the cameras.
    C (2n, cameras - 1): those by the clock offsets of all cameras but the first [1/s].
    weight (2n,): one over each one's sigma [1/px].
    """

    r: Array
    J: Array
    D: Array
    C: Array
    weight: Array


def take_sample(sightings: Sequence[BallSighting], state: State, rig: Rig, sigma_px: float) -> Sample | None:
    """Hold sightings against a pose; take out what another pose and other clocks would explain.

    None as `linearised` gives it.
    Source: (1) and (2) with the clock offsets beside the pose, J' J being J' J and what the filter knows of them.
    """
    one = linearised(sightings, state, rig, sigma_px)
    if one is None:
        return None
    clocks_s = np.sqrt(np.maximum(np.diag(state.P)[OFFSETS:], LEAST_CLOCK_S**2))
    rows = np.ascontiguousarray(np.hstack((one.J, one.C, one.D, one.r[:, None])).T)
    return Sample(*_without_pose(rows, one.J.shape[1], clocks_s))


@compiled("Tuple((f8[:, ::1], f8[::1]))(f8[:, ::1], i8, f8[::1])")
def _without_pose(rows: Array, first: int, clocks_s: Array) -> tuple[Array, Array]:
    """Return N and g of a sample.

    rows (any, 2n): transposed, the slopes J, whose number is `first`, C and D, and the residuals r.
    clocks_s (cameras - 1,): one sigma of each clock offset.
    """
    m, known = len(rows), first + len(clocks_s)
    products = np.zeros((m, m))
    for i in range(m):
        for j in range(i + 1):
            products[i, j] = dot(rows[i], rows[j])
    for i in range(len(clocks_s)):
        products[first + i, first + i] += clocks_s[i] ** -2
    eliminate(products, known)
    size = m - 1 - known
    N, g = np.empty((size, size)), products[m - 1, known : m - 1].copy()
    for i in range(size):
        for j in range(i + 1):
            N[i, j] = N[j, i] = products[known + i, known + j]
    return N, g


def linearised(sightings: Sequence[BallSighting], state: State, rig: Rig, sigma_px: float) -> Linear | None:
    """Hold sightings against a pose; None where fewer than two cameras see enough of the marker.

    Args:
        sightings: each at its own time, soon before or after the state's.
        sigma_px: what a camera adds to the noise of its fits, one sigma [px].
    """
    if len(sightings) < 4 or len({one.camera for one in sightings}) < 2:
        return None
    _, cameras, balls, lags_s, z, covs_px = sighted(tuple(sightings), state.t_ns)
    table, points_inB = camera_table(rig), marker_points(rig)
    r, J, D, C, weight = _held_against(
        state.mean, state.manoeuvre_s, cameras, balls, lags_s, z, covs_px, sigma_px, table, points_inB
    )
    return Linear(r, J, D, C, weight) if np.isfinite(r).all() else None


@compiled("Tuple((f8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[::1]))(f8[::1], f8, i8[::1], i8[::1], f8[::1],"
          " f8[::1], f8[:, ::1], f8, f8[:, ::1], f8[:, ::1])")  # fmt: skip
def _held_against(
    mean: Array, T: float, cameras: Indices, balls: Indices, lags_s: Array, z: Array, covs_px: Array, sigma_px: float,
    table: Array, points_inB: Array,
) -> tuple[Array, Array, Array, Array, Array]:  # fmt: skip
    """Return r, J, D, C and weight of a `Linear`; r is not finite where a ball is behind its camera.

    Source: a camera that goes by t and turns by w about its place c sees the point X as if it had gone by
        -t - w x (X - c).
    """
    h, H = pixels(mean, T, cameras, balls, lags_s, table, points_inB)
    r, weight, arm = z - h, np.empty(len(z)), np.empty(3)
    J, D, C = H[:, :6].copy(), np.zeros((len(z), MOTION * len(table))), H[:, OFFSETS:].copy()
    for s in range(len(cameras)):
        for i in range(3):
            m_inW = dot(mean[3 + 3 * i : 6 + 3 * i], points_inB[balls[s]])
            arm[i] = mean[i] + m_inW - table[cameras[s], 21 + i]
        for row in range(2 * s, 2 * s + 2):
            weight[row] = 1.0 / math.sqrt((covs_px[2 * s, 0] + covs_px[2 * s + 1, 1]) / 2.0 + sigma_px * sigma_px)
            go = D[row, MOTION * cameras[s] : MOTION * (cameras[s] + 1)]
            for i in range(3):
                a, b = (i + 1) % 3, (i + 2) % 3
                go[i] = -weight[row] * H[row, i]
                go[3 + i] = weight[row] * (H[row, a] * arm[b] - H[row, b] * arm[a])
            r[row] *= weight[row]
            J[row] *= weight[row]
            C[row] *= weight[row]
    return r, J, D, C, weight
