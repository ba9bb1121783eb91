"""The estimator: a multiplicative, iterated, gated extended Kalman filter on ball pixels.

The state's error has 12 components (see `state`); attitude errors multiply. A measurement is any set of ball
sightings, each at its own camera's time. Nothing is stored between calls: a state goes in, a new state comes out.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from tracker import so3
from tracker.gate import chi2_limit
from tracker.measure import predicted_pixels
from tracker.rig import Rig
from tracker.state import ATTITUDE, POSITION, Process, State, coasted, process_noise, transition
from tracker.types import Array, BallSighting, Reason, Rejected

MAX_ITERATIONS = 8
CONVERGED_SIGMA = 0.02  # stop when the last step is this small against the posterior's own sigma
MAX_SUSPECTS = 8
LEAST_OPEN_TURN_RAD = 0.01
BEND_SHARE = 0.2  # of a sighting's sigma: less does not matter


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """A fit: the error dx (12,) found, its covariance P (12, 12), the normalised innovation squared, and by how much
    the sum of squares would fall without each sighting (n,)."""

    dx: Array
    P: Array
    nis: float
    gains: Array


@dataclass(frozen=True, slots=True, eq=False)
class Update:
    """An updated state, its NIS and degrees of freedom, what was used and what was left out."""

    state: State
    nis: float
    dof: int
    used: tuple[BallSighting, ...]
    rejected: tuple[Rejected, ...]


def predict(state: State, t_ns: int, process: Process) -> State:
    """Carry a state and its covariance on to t_ns, which is not before the state's own time."""
    dt = (t_ns - state.t_ns) * 1e-9
    if dt < 0.0:
        raise ValueError(f"cannot predict back by {-dt} s")
    filter_ = _filter(state.P)
    filter_.F = transition(state.w_BinB, dt)
    filter_.Q = process_noise(process, dt)
    filter_.predict()
    ahead = coasted(state, t_ns)
    return State(t_ns, ahead.p_BinW, ahead.R_BtoW, ahead.v_BinW, ahead.w_BinB, filter_.P)


def update(state: State, sightings: tuple[BallSighting, ...], rig: Rig, probability: float) -> Update | Rejected:
    """Correct a state by ball sightings, leaving out those that do not belong.

    Args:
        state: predicted to about the sightings' time.
        probability: of a true sighting to pass each gate.
    Returns:
        Update; Rejected FRAME_GATE when no choice of sightings fits the prediction.
    Source: each ball is gated on its innovation (Mahalanobis distance, 2 degrees of freedom). The rest is fitted
        together. When the sum of squares does not fit its chi-square, the smallest set of sightings is left out with
        which it does, of equal sets the one that leaves least; sets of up to a third of all are tried, among those
        without which the sum would fall most. The prior is broad against a pixel, so it is the marker's rigid shape
        that finds the liars. Where a fit leaves a turn so open that its curvature shows, the curvature goes into the
        measurement's covariance and the fit is made again (`_bend`).
    """
    near, rejected = _gated(state, sightings, rig, probability)
    if not near:
        return Rejected(Reason.FRAME_GATE, "no sighting near the prediction", state.t_ns)
    whole = _fit(state, near, rig)
    if whole is None:
        return Rejected(Reason.FRAME_GATE, "the fit runs away", state.t_ns)
    best, liars = whole, tuple[int, ...]()
    suspects = np.argsort(-whole.gains)[:MAX_SUSPECTS].tolist()
    for count in range(1, len(near) // 3 + 1):
        if _fits(best, probability):
            break
        for left_out in combinations(suspects, count):
            fit = _fit(state, [s for i, s in enumerate(near) if i not in left_out], rig)
            if fit is not None and _fits(fit, probability) and not (_fits(best, probability) and best.nis <= fit.nis):
                best, liars = fit, left_out
    if not _fits(best, probability):
        return Rejected(Reason.FRAME_GATE, f"NIS {whole.nis:.0f} with {2 * len(near)} degrees of freedom", state.t_ns)
    rejected += [_gate_rejection(near[i], rig, float(whole.gains[i]), "from what the others say") for i in liars]
    kept = tuple(s for i, s in enumerate(near) if i not in liars)
    return Update(_posterior(state, best.dx, best.P), best.nis, 2 * len(kept), kept, tuple(rejected))


def _fits(fit: _Fit, probability: float) -> bool:
    """Say whether a fit's sum of squares is one that true sightings have."""
    return fit.nis <= chi2_limit(probability, 2 * len(fit.gains))


def _fit(state: State, sightings: list[BallSighting], rig: Rig) -> _Fit | None:
    """Fit sightings, twice where the first fit leaves a turn open; None when the fit runs away."""
    fit = _iterated(state, sightings, rig, None)
    if fit is None:
        return None
    bend_px = _bend(state.moved(fit.dx), fit.P, sightings, rig)
    return fit if bend_px is None else _iterated(state, sightings, rig, bend_px)


def _gated(
    state: State, sightings: tuple[BallSighting, ...], rig: Rig, probability: float
) -> tuple[list[BallSighting], list[Rejected]]:
    """Part sightings by their own Mahalanobis distance from the prediction."""
    limit = chi2_limit(probability, 2)
    z, h, H, R = _stacked(state, sightings, rig)
    S = H @ state.P @ H.T + R
    kept, rejected = [], []
    for i, sighting in enumerate(sightings):
        block = slice(2 * i, 2 * i + 2)
        y = z[block] - h[block]
        distance2 = float(y @ np.linalg.solve(S[block, block], y)) if np.isfinite(y).all() else np.inf
        if distance2 <= limit:
            kept.append(sighting)
        else:
            rejected.append(_gate_rejection(sighting, rig, distance2, "from the prediction"))
    return kept, rejected


def _gate_rejection(sighting: BallSighting, rig: Rig, distance2: float, where: str) -> Rejected:
    """Say which ball was left out and how far off it was."""
    name = rig.marker.balls[sighting.ball].name
    return Rejected(Reason.GATE, f"{name}: {np.sqrt(distance2):.1f} sigma {where}", sighting.t_ns, sighting.camera)


def _iterated(state: State, sightings: list[BallSighting], rig: Rig, bend_px: Array | None) -> _Fit | None:
    """Iterate the update about the newest estimate until it stands.

    Args:
        bend_px: (2n,) one more error of all sightings together, one sigma, or None.
    Returns:
        The fit; None when it takes a ball behind a camera.
    Source: iterated EKF, Bell and Cathey, IEEE Trans. Automatic Control 38 (1993): with H at the newest estimate and
        dx its distance from the prior, the linear update's innovation is z - h + H dx (3). By the multiplicative
        attitude, d/d dx = H diag(I, J_r(theta), I, I) (4).
    """
    dx = np.zeros(12)
    size = 2 * len(sightings)
    for _ in range(MAX_ITERATIONS):
        z, h, H, R = _stacked(state.moved(dx), sightings, rig)
        if not np.isfinite(h).all():
            return None
        H[:, ATTITUDE] = H[:, ATTITUDE] @ so3.right_jacobian(dx[ATTITUDE])  # (4)
        if bend_px is not None:
            R += np.outer(bend_px, bend_px)
        innovation = z - h + H @ dx  # (3)
        filter_ = _filter(state.P, size)
        filter_.update(innovation[:, None], lambda _x, H=H: H, lambda _x, n=size: np.zeros((n, 1)), R=R)
        new = filter_.x[:, 0]
        step = np.abs(new - dx) / np.sqrt(np.diag(filter_.P))
        dx = new
        if float(step.max()) < CONVERGED_SIGMA:
            break
    gains = _gains_without(innovation - H @ dx, R, H @ filter_.P @ H.T)
    return _Fit(dx, filter_.P, float(filter_.mahalanobis) ** 2, gains)


def _bend(state: State, P: Array, sightings: list[BallSighting], rig: Rig) -> Array | None:
    """Return how far a turn that the fit left open bends the balls' paths from straight (2n,) [px], or None if little.

    Two balls do not show a turn about their line. Linearised, a ball off that line moves square to its arm; truly it
    moves on a circle, which a filter that believes its tangent takes for knowledge of the arm's direction.

    Source: turned by phi about the unit axis e, the arm m goes to second order by phi^2/2 (e (e.m) - m). For phi
        normal with variance s, E[phi^4] = 3 s^2, so the rms of that is sqrt(3)/2 s |...|, the mean counted in. s, e:
        the largest eigenvalue of the attitude's covariance and its vector.
    """
    variances, axes = np.linalg.eigh(P[ATTITUDE, ATTITUDE])
    largest, axis = float(variances[2]), axes[:, 2]
    if largest < LEAST_OPEN_TURN_RAD**2:
        return None
    arms = rig.marker.points_inB
    sag_inW = (arms @ np.outer(axis, axis) - arms) * (largest * np.sqrt(3.0) / 2.0) @ state.R_BtoW.T
    _, _, H, R = _stacked(state, sightings, rig)
    balls = [sighting.ball for sighting in sightings]
    J = H[:, POSITION].reshape(-1, 2, 3)
    bend_px = np.asarray((J @ sag_inW[balls][:, :, None]).reshape(-1))
    return bend_px if bool((np.abs(bend_px) > BEND_SHARE * np.sqrt(np.diag(R))).any()) else None


def _gains_without(residual: Array, R: Array, explained: Array) -> Array:
    """Return for each sighting by how much the sum of squares falls when it is left out (n,).

    Args:
        residual: (2n,) after the fit.  R, explained: (2n, 2n) of the measurements and of the fitted pixels.
    Source: the residual's covariance is R - H P H'; its 2 x 2 block W on the diagonal makes r' W^-1 r that fall
        (Baarda, "A testing procedure for use in geodetic networks", 1968, for blocks).
    """
    gains = np.empty(len(residual) // 2)
    for i in range(len(gains)):
        block = slice(2 * i, 2 * i + 2)
        W = R[block, block] * (1.0 + 1e-6) - explained[block, block]
        gains[i] = residual[block] @ np.linalg.solve(W, residual[block])
    return gains


def _posterior(prior: State, dx: Array, P: Array) -> State:
    """Put the error into the nominal state and turn the attitude covariance with it.

    Source: exp(theta + d) = exp(theta) exp(J_r(theta) d), so the error about the new attitude is J_r d.
    """
    G = np.eye(12)
    G[ATTITUDE, ATTITUDE] = so3.right_jacobian(dx[ATTITUDE])
    turned = G @ P @ G.T
    moved = prior.moved(dx)
    return State(prior.t_ns, moved.p_BinW, moved.R_BtoW, moved.v_BinW, moved.w_BinB, (turned + turned.T) / 2.0)


def _stacked(state: State, sightings: list[BallSighting] | tuple[BallSighting, ...], rig: Rig) -> tuple[Array, ...]:
    """Return z (2n,), h (2n,), H (2n, 12) and R (2n, 2n) of sightings, in their order."""
    n = len(sightings)
    z, h, H, R = np.empty(2 * n), np.empty(2 * n), np.empty((2 * n, 12)), np.zeros((2 * n, 2 * n))
    seen: dict[tuple[int, int], tuple[Array, Array]] = {}
    for i, sighting in enumerate(sightings):
        view = (sighting.camera, sighting.t_ns)
        if view not in seen:
            seen[view] = predicted_pixels(state, rig.cameras[sighting.camera], rig.marker, sighting.t_ns)
        uv_px, Hs = seen[view]
        block = slice(2 * i, 2 * i + 2)
        z[block], h[block], H[block], R[block, block] = (
            sighting.uv_px, uv_px[sighting.ball], Hs[sighting.ball], sighting.cov_px,
        )  # fmt: skip
    return z, h, H, R


def _filter(P: Array, dim_z: int = 2) -> ExtendedKalmanFilter:
    """Return filterpy's EKF over the error state, whose mean is zero before every step."""
    filter_ = ExtendedKalmanFilter(dim_x=12, dim_z=dim_z)
    filter_.P = P
    return filter_
