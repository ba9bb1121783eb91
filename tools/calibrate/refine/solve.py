"""Where bumped cameras stand now, by what all cameras saw of the balls; those that were not bumped hold the room.

Source: Gauss-Newton on the motions of the cameras, the vehicle's pose at each instant taken out of the equations as in
    `tracker.health.sample`, with Cauchy's weights: a sighting s sigmas off counts 1 / (1 + s^2 / CAUCHY^2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tools.calibrate.refine.evidence import Instant
from tracker.camera import Camera
from tracker.health.sample import MOTION, Linear, linearised
from tracker.maths import so3
from tracker.rig import Rig
from tracker.state import State
from tracker.types import Array, frozen_array

STEPS = 8
SIGMA_PX = 0.05  # what a camera adds to its fits
CAUCHY = 2.4  # sigmas; Holland, Welsch, "Robust regression using iteratively reweighted least squares" (1977)
BUMP_M, BUMP_RAD = 0.03, np.radians(2.0)  # one sigma, so that what nothing tells stays where it was
BIAS_PX = 0.03  # by which a camera sees a ball aside always, however still the pixels are: shade, paint, the arms


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """cameras: all of the rig, the bumped ones mended.

    covariance (6 bumped, 6 bumped): of their places in W [m], then turns in W [rad], chance and bias together.
    off_mm: how far off the vehicle stood by the cameras as they were, mean.
    sigma_mm: what its place is known to by the mended ones, one sigma on an axis, mean.
    """

    cameras: tuple[Camera, ...]
    covariance: Array
    off_mm: float
    sigma_mm: float


def refine(instants: Sequence[Instant], rig: Rig, bumped: tuple[int, ...]) -> Refined:
    """Find where the bumped cameras stand."""
    now, states, done = rig, [one.state for one in instants], np.zeros(MOTION * len(bumped))
    columns = np.concatenate([np.arange(MOTION * c, MOTION * (c + 1)) for c in bumped])
    for _ in range(STEPS):
        linear = _linearised(instants, states, now, columns)
        N, g = _equations(linear, done)
        motion = np.asarray(np.linalg.solve(N, g), dtype=np.float64)
        done = done + motion
        poses = [None if one is None else np.linalg.lstsq(one.J, one.r - one.D @ motion)[0] for one in linear]
        states = [
            state if pose is None else state.moved(np.append(pose, np.zeros(len(state.P) - len(pose))))
            for state, pose in zip(states, poses, strict=True)
        ]
        now = replace(now, cameras=_moved(now.cameras, bumped, motion))
    linear = _linearised(instants, states, now, columns)
    covariance = _covariance(linear, instants, rig, done)
    effects = [_at_vehicle(one) for one in linear if one is not None]
    off_mm = 1e3 * float(np.mean([np.linalg.norm(effect @ done) for effect in effects]))
    variances = [float(np.trace(effect @ covariance @ effect.T)) / 3.0 for effect in effects]
    return Refined(now.cameras, covariance, off_mm, 1e3 * float(np.sqrt(np.mean(variances))))


def _linearised(instants: Sequence[Instant], states: Sequence[State], rig: Rig, columns: Array) -> list[Linear | None]:
    """Linearise each instant, weighed robustly, the bumped cameras' columns only."""
    found: list[Linear | None] = []
    for instant, state in zip(instants, states, strict=True):
        one = linearised(instant.sightings, state, rig, SIGMA_PX)
        found.append(None if one is None else _weighed(replace(one, D=one.D[:, columns])))
    return found


def _weighed(one: Linear) -> Linear:
    """Return an instant whose sightings count by how well they fit."""
    rest = one.r - one.J @ np.linalg.lstsq(one.J, one.r)[0]
    squared = (rest.reshape(-1, 2) ** 2).sum(axis=1) / 2.0
    root = np.repeat(1.0 / np.sqrt(1.0 + squared / CAUCHY**2), 2)
    return Linear(root * one.r, root[:, None] * one.J, root[:, None] * one.D, root * one.weight)


def _without_pose(one: Linear) -> Array:
    """Return the cameras' slopes less what another pose explains (2n, 6 bumped)."""
    basis = np.linalg.qr(one.J)[0]
    return np.asarray(one.D - basis @ (basis.T @ one.D))


def _equations(linear: Sequence[Linear | None], done: Array) -> tuple[Array, Array]:
    """Return the normal equations of a motion on top of what was done already."""
    prior = np.tile(np.repeat([BUMP_M**-2, BUMP_RAD**-2], 3), len(done) // MOTION)
    N, g = np.diag(prior), -prior * done
    for one in linear:
        if one is not None:
            D = _without_pose(one)
            N, g = N + D.T @ D, g + D.T @ one.r
    return N, g


def _covariance(linear: Sequence[Linear | None], instants: Sequence[Instant], rig: Rig, done: Array) -> Array:
    """Return the covariance of the motions: by chance, as large as the residuals are, and by each ball's bias."""
    N, _ = _equations(linear, done)
    balls, squares, rows = len(rig.marker), 0.0, 0
    by_bias = np.zeros((len(N), 2 * len(rig.cameras) * balls))
    for one, instant in zip(linear, instants, strict=True):
        if one is None:
            continue
        D, rest = _without_pose(one), one.r - one.J @ np.linalg.lstsq(one.J, one.r)[0]
        squares, rows = squares + float(rest @ rest), rows + len(rest) - MOTION
        which = 2 * np.array([balls * sighting.camera + sighting.ball for sighting in instant.sightings])
        for axis in range(2):
            np.add.at(by_bias.T, which + axis, (D * one.weight[:, None])[axis::2])
    inverse = np.linalg.inv(N)
    shifts = BIAS_PX * inverse @ by_bias
    return np.asarray(max(1.0, squares / max(1, rows)) * inverse + shifts @ shifts.T)


def _at_vehicle(one: Linear) -> Array:
    """Return by how much the vehicle's place goes with motions of the cameras (3, 6 bumped)."""
    return np.asarray(np.linalg.lstsq(one.J, one.D)[0][:3])


def _moved(cameras: tuple[Camera, ...], bumped: tuple[int, ...], motion: Array) -> tuple[Camera, ...]:
    """Return the cameras after a motion of the bumped ones."""
    after = list(cameras)
    for k, index in enumerate(bumped):
        step, camera = motion[MOTION * k : MOTION * (k + 1)], cameras[index]
        after[index] = replace(
            camera,
            R_CtoW=frozen_array(so3.exp(step[3:]) @ camera.R_CtoW),
            p_CinW=frozen_array(camera.p_CinW + step[:3]),
        )
    return tuple(after)
