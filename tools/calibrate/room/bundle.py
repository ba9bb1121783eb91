"""Bundle adjustment: the scene that fits all sightings best, and how well they tell it.

Unknown are each camera's pose and clock, the marker's pose at each instant and, if asked, focal lengths and centres and
the places of the balls on the marker. The normal equations are sparse and solved directly: least_squares of SciPy would
solve them by LSMR, which stops short of the precision wanted here, and gives no covariance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import splu
from scipy.spatial.transform import Rotation

from tools.calibrate.room.jacobian import Layout, residuals, slopes
from tools.calibrate.room.robust import NORMAL, claimed_px, cost_of, scale_of, weights_of
from tools.calibrate.room.scene import Indices, Scene, Seen
from tools.calibrate.room.start import placed
from tracker.camera import Camera
from tracker.types import Array, frozen_array

MOST_STEPS = 40
ENOUGH = 1e-5  # of a step, in units of what each unknown is known to
LITTLE = 0.25  # weight of an outlier
LEAST_SCALE = 0.1
FIRST_DAMPING, MOST_DAMPING = 1e-4, 1e8


@dataclass(frozen=True, slots=True, eq=False)
class Adjusted:
    """What an adjustment came to.

    sigma_px: robust one sigma of a residual.  scale: of residuals, by what the images claim.
    rms_px: of all residuals, weighted as the fit weighs them.
    outliers: share of sightings that counted for less than a quarter.
    covariance (g, g): of the unknowns that are not the marker's poses, see `Layout`, if errors came by chance alone.
    shifts (g, 2 * cameras * balls): what they change by if a camera sees a ball a pixel to the right, or lower, always.
    by_marker (g, 3 * balls): what they change by with each ball's place in B [1/m].
    """

    scene: Scene
    layout: Layout
    sigma_px: float
    scale: float
    rms_px: float
    outliers: float
    covariance: Array
    shifts: Array
    by_marker: Array


def adjust(scene: Scene, seen: Seen, layout: Layout) -> Adjusted:
    """Find the scene that fits best.

    Args:
        scene: a guess; its camera 0 stays where it is, and so does its clock.
        seen: sightings at the instants of the scene's marker poses.
        layout: what is unknown.
    Source: Levenberg-Marquardt with Cauchy's weights, their scales from the medians of the residuals.
    """
    damping, prior, claimed = FIRST_DAMPING, layout.prior(), claimed_px(seen)
    origin = layout.values(scene)
    for _ in range(MOST_STEPS):
        r, J = residuals(scene, seen), slopes(scene, seen, layout)
        sigma_px = claimed * max(LEAST_SCALE, scale_of(r, claimed))
        away = layout.values(scene) - origin
        N, gradient = _equations(r, J, sigma_px, prior, away)
        cost = cost_of(r, sigma_px) + float(away @ (prior * away))
        while damping < MOST_DAMPING:
            step = -_factor(N + diags_array(damping * N.diagonal())).solve(gradient)
            candidate = stepped(scene, step, layout)
            away, r = layout.values(candidate) - origin, residuals(candidate, seen)
            if np.isfinite(r).all() and cost_of(r, sigma_px) + float(away @ (prior * away)) <= cost:
                break
            damping *= 10.0
        else:
            break
        scene, damping = candidate, max(damping / 10.0, 1e-12)
        if float(np.abs(step * np.sqrt(N.diagonal())).max()) < ENOUGH * np.sqrt(len(r)):
            break
    return _judged(scene, seen, layout)


def _equations(r: Array, J: csr_array, sigma_px: Array, prior: Array, away: Array) -> tuple[csc_array, Array]:
    """Return the normal equations' matrix and right side; away (size,): how far the unknowns are from their priors."""
    JtW = J.T @ diags_array(np.repeat(weights_of(r, sigma_px) / sigma_px**2, 2))
    return csc_array(JtW @ J + diags_array(prior)), JtW @ r + prior * away


def stepped(scene: Scene, step: Array, layout: Layout) -> Scene:
    """Return a scene whose unknowns went on by a step, rotations by R exp(step)."""
    cameras, offsets_s = list(scene.cameras), scene.offsets_s.copy()
    for c, camera in enumerate(cameras):
        if c > 0:
            d = step[layout.camera(c)]
            R = camera.R_CtoW @ Rotation.from_rotvec(d[3:6]).as_matrix()
            cameras[c] = placed(camera, R, camera.p_CinW + d[:3])
            offsets_s[c] += d[6]
        if layout.lenses:
            log_focal, u_px, v_px = step[layout.lens(c)].tolist()
            cameras[c] = zoomed(cameras[c], math.exp(log_focal), (u_px, v_px))
    points = scene.points_inB + step[layout.marker_at].reshape(-1, 3) if layout.marker else scene.points_inB
    d = step[layout.globals :].reshape(-1, 6)
    R_BtoW = scene.R_BtoW @ Rotation.from_rotvec(d[:, 3:]).as_matrix()
    return Scene(tuple(cameras), offsets_s, points, scene.p_BinW + d[:, :3], R_BtoW)


def zoomed(camera: Camera, factor: float, shift_px: tuple[float, float]) -> Camera:
    """Return a camera of another focal length, and with its centre elsewhere."""
    K = np.array(camera.K)
    K[[0, 1], [0, 1]] *= factor
    K[:2, 2] += shift_px
    return replace(camera, K=frozen_array(K))


def _factor(N: csc_array) -> splu:
    return splu(csc_array(N), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})


def _judged(scene: Scene, seen: Seen, layout: Layout) -> Adjusted:
    """Say how well the sightings fit, and how well they tell the unknowns."""
    r, J, claimed = residuals(scene, seen), slopes(scene, seen, layout), claimed_px(seen)
    scale = max(LEAST_SCALE, scale_of(r, claimed))
    weight = weights_of(r, scale * claimed)
    both, sigma_px = np.repeat(weight, 2), np.repeat(scale * claimed, 2)
    excess = max(1.0, float((both * (r / sigma_px) ** 2).sum() / max(1.0, both.sum() - layout.size)))
    JtW = J.T @ diags_array(both / sigma_px**2)
    factor = _factor(csc_array(JtW @ J + diags_array(layout.prior())))
    covariance = excess * factor.solve(np.eye(layout.size, layout.globals))[: layout.globals]
    always = np.zeros((len(r), 2 * layout.kinds))
    always[np.arange(len(r)), _kinds(seen)] = 1.0
    shifts = factor.solve(JtW @ always)[: layout.globals]
    free = replace(layout, marker=True)
    by_marker = factor.solve((JtW @ slopes(scene, seen, free)[:, free.marker_at]).toarray())[: layout.globals]
    rms_px = float(np.sqrt((both * r**2).sum() / both.sum()))
    outliers = float((weight < LITTLE).mean())
    middle_px = NORMAL * float(np.median(np.abs(r)))
    return Adjusted(scene, layout, middle_px, scale, rms_px, outliers, covariance, shifts, by_marker)


def _kinds(seen: Seen) -> Indices:
    """Return of each residual (2n,) which ball it is of in which camera, and along which axis, as a number."""
    cameras, _, balls, _ = seen.uv_px.shape
    counts = seen.there.sum(axis=1)
    return np.concatenate([np.tile(np.arange(2 * balls) + 2 * balls * c, counts[c]) for c in range(cameras)])
