"""What the rays to the balls say of the cameras' stand at one instant.

Source: with r the residuals of the sightings (whitened), J their slope by the vehicle's pose and D that by small
    motions of the cameras, P = I - J (J'J)^-1 J' takes out what another pose would explain. What is left tells of the
    motions c by r ~ D c: information N = D' P D (1), gradient g = D' P r (2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tracker.filter.measure import Indices, camera_table, marker_points, pixels
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
    Source: (1) and (2) with the clock offsets beside the pose, J' J being J' J and what the filter knows of them; their
        rows of one over sigma below the slopes make an orthogonal basis whose upper part does that.
    """
    one = linearised(sightings, state, rig, sigma_px)
    if one is None:
        return None
    clocks_s = np.sqrt(np.maximum(np.diag(state.P)[OFFSETS:], LEAST_CLOCK_S**2))
    known = np.hstack((np.zeros((len(clocks_s), one.J.shape[1])), np.diag(1.0 / clocks_s)))
    basis = np.linalg.qr(np.vstack((np.hstack((one.J, one.C)), known)))[0][: len(one.r)]
    within = basis.T @ one.D
    return Sample(one.D.T @ one.D - within.T @ within, one.D.T @ one.r - within.T @ (basis.T @ one.r))


def linearised(sightings: Sequence[BallSighting], state: State, rig: Rig, sigma_px: float) -> Linear | None:
    """Hold sightings against a pose; None where fewer than two cameras see enough of the marker.

    Args:
        sightings: each at its own time, soon before or after the state's.
        sigma_px: what a camera adds to the noise of its fits, one sigma [px].
    """
    cameras = np.array([sighting.camera for sighting in sightings])
    if len(sightings) < 4 or len(set(cameras.tolist())) < 2:
        return None
    balls = np.array([sighting.ball for sighting in sightings])
    lags_s = np.array([sighting.t_ns - state.t_ns for sighting in sightings]) * 1e-9
    h, H = pixels(state.mean, state.manoeuvre_s, cameras, balls, lags_s, camera_table(rig), marker_points(rig))
    if not np.isfinite(h).all():
        return None
    variances = np.array([one.cov_px for one in sightings]).trace(axis1=1, axis2=2) / 2.0 + sigma_px**2
    weight = np.repeat(1.0 / np.sqrt(variances), 2)
    r = weight * (np.concatenate([sighting.uv_px for sighting in sightings]) - h)
    D = weight[:, None] * _by_cameras(H[:, :3], cameras, balls, state, rig)
    return Linear(r, weight[:, None] * H[:, :6], D, weight[:, None] * H[:, OFFSETS:], weight)


def _by_cameras(J_px: Array, cameras: Indices, balls: Indices, state: State, rig: Rig) -> Array:
    """Return d pixel / d motion of the cameras (2n, 6 cameras) of balls with d pixel / d place J_px (2n, 3).

    Source: a camera that goes by t and turns by w about its place c sees the point X as if it had gone by
        -t - w x (X - c).
    """
    D = np.zeros((len(J_px), len(rig.cameras), MOTION))
    rows, of = np.arange(len(J_px)), np.repeat(cameras, 2)
    balls_inW = state.p_BinW + marker_points(rig)[balls] @ state.R_BtoW.T
    arms = balls_inW - np.array([camera.p_CinW for camera in rig.cameras])[cameras]
    D[rows, of, :3] = -J_px
    D[rows, of, 3:] = np.cross(J_px, np.repeat(arms, 2, axis=0))
    return D.reshape(len(J_px), -1)
