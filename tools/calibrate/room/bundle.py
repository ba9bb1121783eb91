"""Bundle adjustment: the scene that fits all sightings best, and how well they tell it.

Unknown are each camera's pose and clock, the marker's pose at each instant and, if asked, focal lengths and the places
of the balls on the marker. The normal equations are sparse and solved directly: least_squares of SciPy would solve them
by LSMR, which stops short of the precision wanted here, and gives no covariance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu
from scipy.spatial.transform import Rotation

from tools.calibrate.room.jacobian import Layout, residuals, slopes
from tools.calibrate.room.scene import Scene, Seen
from tools.calibrate.room.start import placed
from tracker.camera import Camera
from tracker.types import Array, frozen_array

MOST_STEPS = 40
ENOUGH = 1e-5  # of a step, in units of what each unknown is known to
CAUCHY = 2.4  # sigmas; Holland, Welsch, "Robust regression using iteratively reweighted least squares" (1977)
LEAST_SIGMA_PX = 0.02
FIRST_DAMPING, MOST_DAMPING = 1e-4, 1e8


@dataclass(frozen=True, slots=True, eq=False)
class Adjusted:
    """What an adjustment came to.

    sigma_px: robust one sigma of a pixel's residual.  rms_px: of all residuals, weighted as the fit weighs them.
    outliers: share of sightings that counted for less than a quarter.
    covariance (g, g): of the unknowns that are not the marker's poses, see `Layout`.
    """

    scene: Scene
    layout: Layout
    sigma_px: float
    rms_px: float
    outliers: float
    covariance: Array


def adjust(scene: Scene, seen: Seen, layout: Layout) -> Adjusted:
    """Find the scene that fits best.

    Args:
        scene: a guess; its camera 0 stays where it is, and so does its clock.
        seen: sightings at the instants of the scene's marker poses.
        layout: what is unknown.
    Source: Levenberg-Marquardt with Cauchy's weights, their scale from the median of the residuals.
    """
    damping, prior = FIRST_DAMPING, layout.prior()
    origin = layout.values(scene)
    for _ in range(MOST_STEPS):
        r, J = residuals(scene, seen), slopes(scene, seen, layout)
        sigma_px = _scale(r)
        weight = _weights(r, sigma_px)
        W = diags_array(weight / sigma_px**2)
        pull = prior * (layout.values(scene) - origin)
        N = csc_array(J.T @ (W @ J)) + diags_array(prior)
        gradient = J.T @ (W @ r) + pull
        cost = _cost(r, sigma_px) + float(pull @ (layout.values(scene) - origin))
        while damping < MOST_DAMPING:
            step = -_factor(N + diags_array(damping * N.diagonal())).solve(gradient)
            candidate = stepped(scene, step, layout)
            away = layout.values(candidate) - origin
            r_new = residuals(candidate, seen)
            if np.isfinite(r_new).all() and _cost(r_new, sigma_px) + float(away @ (prior * away)) <= cost:
                break
            damping *= 10.0
        else:
            break
        scene, damping = candidate, max(damping / 10.0, 1e-12)
        if float(np.abs(step * np.sqrt(N.diagonal())).max()) < ENOUGH * np.sqrt(len(r)):
            break
    return _judged(scene, seen, layout, prior)


def stepped(scene: Scene, step: Array, layout: Layout) -> Scene:
    """Return a scene whose unknowns went on by a step, rotations by R exp(step)."""
    cameras, offsets_s = list(scene.cameras), scene.offsets_s.copy()
    for c, camera in enumerate(cameras):
        if c > 0:
            d = step[layout.camera(c)]
            R = camera.R_CtoW @ Rotation.from_rotvec(d[3:6]).as_matrix()
            cameras[c] = placed(camera, R, camera.p_CinW + d[:3])
            offsets_s[c] += d[6]
        if layout.focal:
            cameras[c] = zoomed(cameras[c], float(np.exp(step[layout.focal_at(c)])))
    points = scene.points_inB + step[layout.marker_at].reshape(-1, 3) if layout.marker else scene.points_inB
    d = step[layout.globals :].reshape(-1, 6)
    R_BtoW = scene.R_BtoW @ Rotation.from_rotvec(d[:, 3:]).as_matrix()
    return Scene(tuple(cameras), offsets_s, points, scene.p_BinW + d[:, :3], R_BtoW)


def zoomed(camera: Camera, factor: float) -> Camera:
    """Return a camera of another focal length."""
    K = np.array(camera.K)
    K[[0, 1], [0, 1]] *= factor
    return replace(camera, K=frozen_array(K))


def _factor(N: csc_array) -> splu:
    return splu(csc_array(N), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})


def _scale(r: Array) -> float:
    """Return one sigma of the pixels, as if their errors were normal."""
    return max(LEAST_SIGMA_PX, 1.4826 * float(np.median(np.abs(r))))


def _weights(r: Array, sigma_px: float) -> Array:
    """Return the weight of each residual: both of a sighting's share one."""
    squared = (r.reshape(-1, 2) ** 2).sum(axis=1) / (2.0 * sigma_px**2)
    return np.repeat(1.0 / (1.0 + squared / CAUCHY**2), 2)


def _cost(r: Array, sigma_px: float) -> float:
    squared = (r.reshape(-1, 2) ** 2).sum(axis=1) / (2.0 * sigma_px**2)
    return float(2.0 * CAUCHY**2 * np.log1p(squared / CAUCHY**2).sum())


def _judged(scene: Scene, seen: Seen, layout: Layout, prior: Array) -> Adjusted:
    r, J = residuals(scene, seen), slopes(scene, seen, layout)
    sigma_px = _scale(r)
    weight = _weights(r, sigma_px)
    rms_px = float(np.sqrt((weight * r**2).sum() / weight.sum()))
    g = layout.globals
    N = csc_array(J.T @ (diags_array(weight / max(rms_px, LEAST_SIGMA_PX) ** 2) @ J)) + diags_array(prior)
    columns = np.zeros((N.shape[0], g))
    columns[:g] = np.eye(g)
    covariance = _factor(N).solve(columns)[:g]
    return Adjusted(scene, layout, sigma_px, rms_px, float((weight < 0.25).mean()), np.asarray(covariance))
