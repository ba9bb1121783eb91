"""The likeliest state between a prediction and a batch of sightings."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tracker.filter import manoeuvre
from tracker.filter.batch import Batch, Sighted
from tracker.filter.bend import bend_noise
from tracker.filter.correction import TILT_ROWS, likeliest, weighed
from tracker.filter.manoeuvre import as_gained, expected, judged, log_likelihoods
from tracker.filter.matern import process_noise
from tracker.filter.measure import Indices, camera_table
from tracker.filter.predict import Prediction
from tracker.maths.compiled import compiled
from tracker.rig import Rig
from tracker.state import ATTITUDE
from tracker.types import Array

LEAST_OPEN_TURN_RAD = 0.01
BEND_SHARE = 0.2  # of a sighting's sigma: less does not matter
LEAST_DOUBT = 0.2  # of the pixels' own noise: less does not matter
CLOCK_OPEN_PX = 5.0  # one sigma, about a ball's radius: beyond, no slope at one speed and one offset speaks for others
SHORTEST_S = 1e-3  # a tilt measured twice within less tells no more


class Fit(NamedTuple):
    """A fit of some sightings: the error dx found, and what leads there from the prior by one linear update.

    P: prior covariance with the manoeuvre's noise in it.  levels: of the manoeuvre, after these sightings.
    H (2n + 2, size), R: slope and covariance of the sightings, then of the tilt.
    u, inverse: S^-1 y and S^-1 of the sightings.  nis: y' S^-1 y.
    """

    sighted: Sighted
    dx: Array
    P: Array
    levels: Array
    H: Array
    R: Array
    u: Array
    inverse: Array
    nis: float

    def gains(self) -> Array:
        """Return by how much the sum of squares would fall without each sighting (n,).

        Source: u_i' (S^-1_ii)^-1 u_i; Baarda, "A testing procedure for use in geodetic networks", 1968, for blocks.
        """
        n = len(self.u) // 2
        u = self.u.reshape(n, 2)
        blocks = np.stack([self.inverse[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] for i in range(n)])
        return np.asarray((u * np.linalg.solve(blocks, u[:, :, None])[:, :, 0]).sum(axis=1))

    def log_likelihood(self) -> float:
        """Return the log likelihood of the innovations, up to a constant."""
        return 0.5 * (float(np.linalg.slogdet(self.inverse)[1]) - self.nis)


def fit(ahead: Prediction, batch: Batch, rig: Rig, *, adapt: bool = True) -> Fit | None:
    """Fit a batch; None when the fit runs away.

    adapt: let the batch itself tell how brisk the manoeuvre is.
    Two balls do not show the turn about their line. Then roll and pitch, which stay within bounds over a flight, bound
    it, and where its curvature shows, that goes into the noise and the fit is made again (`_bend`).
    """
    process, n = ahead.process, len(batch.y)
    levels, P, R, doubtful = prepared(
        ahead.state.levels, manoeuvre.strengths(process), batch.y, batch.H, batch.A, batch.B, batch.R, batch.path,
        batch.doubt, ahead.P_coasted, ahead.dt, process.manoeuvre_s, tilt_variance(ahead), adapt,
        looks_alone(batch.sighted.cameras), ahead.turn_open,
    )  # fmt: skip
    agreed = None if doubtful and _clock_open(batch) else _fitted(ahead, batch, rig, levels, P, R)
    if not doubtful:
        return agreed
    R = R.copy()
    R[:n, :n] += batch.doubt
    doubted = _fitted(ahead, batch, rig, levels, P, R)
    return _likelier(agreed, doubted)


def tilt_variance(ahead: Prediction) -> float:
    """Return the variance of roll and of pitch: a tilt that lasts, as white noise of the same spectral density."""
    process = ahead.process
    return 2.0 * process.tilt_rad**2 * process.tilt_s / max(ahead.dt, SHORTEST_S)


@compiled("Tuple((f8[:, ::1], f8[:, ::1], f8[:, ::1], b1))(f8[:, ::1], f8[:, ::1], f8[::1], f8[:, ::1],"
          " f8[:, ::1], f8[:, :, ::1], f8[:, ::1], f8[:, :, ::1], f8[:, ::1], f8[:, ::1], f8, f8, f8, b1,"
          " b1, b1)")  # fmt: skip
def prepared(
    levels: Array, of: Array, y: Array, H: Array, A: Array, B: Array, R_pixels: Array, path: Array, doubt: Array,
    P_coasted: Array, dt: float, T: float, tilt: float, adapt: bool, alone: bool, unseen: bool,
) -> tuple[Array, Array, Array, bool]:  # fmt: skip
    """Return levels, prior covariance, noise of pixels and tilt, and whether the doubt of the clocks matters.

    tilt: variance of roll and of pitch.  alone: whether one camera looks. Its speed and its clock explain each other,
    so what a manoeuvre did is seen less well than its pixels say, and the levels' mean strength stands.
    unseen: whether a turn is open; then axes that are seen to be quiet do not tell whether it is, and the level of
    rotation is only raised.  The others as `Batch`, `Prediction` and `manoeuvre`
    name them.
    """
    n = len(y)
    if adapt and dt > 0.0:
        before, levels = levels, judged(levels, log_likelihoods(y, A, B, of, expected(levels, of)))
        if unseen and expected(levels, of)[1] < expected(before, of)[1]:
            levels[1] = before[1]
    means = expected(levels, of) if alone else as_gained(levels, of, H, A, B, dt, T)
    R, noise, doubts = np.zeros((n + TILT_ROWS, n + TILT_ROWS)), 0.0, 0.0
    for i in range(n):
        for j in range(n):
            R[i, j] = R_pixels[i, j]
            for k in range(len(path)):
                R[i, j] += means[k] * path[k, i, j]
        noise, doubts = noise + R[i, i], doubts + doubt[i, i]
    for i in range(n, n + TILT_ROWS):
        R[i, i] = tilt
    P = P_coasted + process_noise(len(P_coasted), dt, T, means)
    return levels, P, R, not doubts < LEAST_DOUBT * noise


@compiled("b1(i8[::1])")
def looks_alone(cameras: Indices) -> bool:
    """Say whether all sightings are one camera's."""
    return bool((cameras == cameras[0]).all())


def _clock_open(batch: Batch) -> bool:
    """Say whether a camera looks alone while speed times clock offset, both unknown, moves what it sees by much.

    It shows no instant that clocks could agree on; taken at its word it makes a wrong speed and a wrong offset that
    bear each other out.
    """
    return looks_alone(batch.sighted.cameras) and float(np.trace(batch.doubt)) > len(batch.y) * CLOCK_OPEN_PX**2


def _likelier(agreed: Fit | None, doubted: Fit | None) -> Fit | None:
    """Choose between a fit that takes the cameras' clocks to agree and one that leaves it open.

    While speed and offset are both unknown, doubt would throw away all that two cameras know together; nearly always
    they do show one instant, and where they do not, the rays to three moving balls miss each other.
    """
    if agreed is None or doubted is None:
        return doubted or agreed
    return agreed if agreed.log_likelihood() > doubted.log_likelihood() else doubted


def _fitted(ahead: Prediction, batch: Batch, rig: Rig, levels: Array, P: Array, R: Array) -> Fit | None:
    """Fit with a given prior covariance P and noise R; None when the fit runs away."""
    stands, turn_open, dx, H, u, inverse, nis = _solve(ahead, batch.sighted, rig, P, R)
    if stands and turn_open:
        bend = _bend(ahead, batch.sighted, rig, dx, P, H, R)
        if bend is not None:
            n, R = len(bend), R.copy()
            R[:n, :n] += bend
            stands, _, dx, H, u, inverse, nis = _solve(ahead, batch.sighted, rig, P, R)
    return Fit(batch.sighted, dx, P, levels, H, R, u, inverse, nis) if stands else None


Solution = tuple[bool, bool, Array, Array, Array, Array, float]
"""Whether there is one; whether it leaves a turn open; dx, H, u, inverse and nis of a `Fit`."""


def _solve(ahead: Prediction, seen: Sighted, rig: Rig, P: Array, R: Array) -> Solution:
    return solved(
        ahead.state.mean, P, ahead.process.manoeuvre_s, seen.z, R, seen.cameras, seen.balls, seen.lags_s,
        camera_table(rig), ahead.points_of(rig),
    )  # fmt: skip


@compiled("Tuple((b1, b1, f8[::1], f8[:, ::1], f8[::1], f8[:, ::1], f8))(f8[::1], f8[:, ::1], f8, f8[::1],"
          " f8[:, ::1], i8[::1], i8[::1], f8[::1], f8[:, ::1], f8[:, ::1])")  # fmt: skip
def solved(
    mean: Array, P: Array, T: float, z: Array, R: Array, cameras: Indices, balls: Indices, lags_s: Array,
    table: Array, points_inB: Array,
) -> Solution:  # fmt: skip
    """Find the likeliest state and weigh the innovations there; arguments as for `likeliest`."""
    dx, y, H, variances = likeliest(mean, P, T, z, R, cameras, balls, lags_s, table, points_inB)
    u, inverse, nis = weighed(y, H, P, R)
    turn_open = variances[ATTITUDE].max() > LEAST_OPEN_TURN_RAD**2 / 3.0
    return np.isfinite(dx).all(), turn_open, dx, H, u, inverse, nis


def _bend(ahead: Prediction, seen: Sighted, rig: Rig, dx: Array, P: Array, H: Array, R: Array) -> Array | None:
    """Return the covariance (2n, 2n) [px^2] of what a pose left open does beyond first order, None if little.

    Arms are from the pivot, so a turn about two balls bends nothing; what one camera alone leaves open does.
    """
    HP = H @ P
    after = P - HP.T @ np.linalg.solve(HP @ H.T + R, HP)
    noise = bend_noise(
        ahead.state.mean, dx, after, ahead.process.manoeuvre_s, seen.cameras, seen.balls, seen.lags_s,
        camera_table(rig), ahead.points_of(rig),
    )  # fmt: skip
    little = np.diag(noise) < BEND_SHARE**2 * np.diag(R)[: len(noise)]
    return None if bool(little.all()) else np.asarray(noise)
