"""The sightings of one round as arrays, and what a prediction says of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracker.correction import innovation_covariance, path_noise
from tracker.manoeuvre import variances
from tracker.measure import Indices, camera_table, marker_points, pixels
from tracker.predict import Prediction
from tracker.rig import Rig
from tracker.singer import process_noise
from tracker.state import ATTITUDE, OFFSETS, POSITION, RATE, VELOCITY
from tracker.types import Array, BallSighting


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """Sightings as arrays, and what the prediction says of them.

    z (2n,), R (2n, 2n): pixels and the noise of fit and camera.  cameras, balls, lags_s (n,) [s].
    y (2n,): the prediction's innovation.  A (2n, 2n): its covariance without any manoeuvre.
    B (2, 2n, 2n): what accelerations of variance 1 add to it, of translation and of rotation.
    path (2, 2n, 2n): the part of B that lies between the state's time and the cameras'.
    doubt (2n, 2n): unknown speed times unknown clock offset, part of A.
    tops (2,): the envelope's variances.
    """

    sightings: tuple[BallSighting, ...]
    z: Array
    R: Array
    cameras: Indices
    balls: Indices
    lags_s: Array
    y: Array
    A: Array
    B: Array
    path: Array
    doubt: Array
    tops: Array

    def part(self, kept: list[int]) -> Batch:
        """Return the batch with only the sightings of these indices."""
        if len(kept) == len(self.sightings):
            return self
        i = np.array(kept)
        rows = np.stack((2 * i, 2 * i + 1), axis=1).reshape(-1)
        square = (..., rows[:, None], rows)
        return Batch(
            tuple(self.sightings[k] for k in kept), self.z[rows], self.R[square], self.cameras[i], self.balls[i],
            self.lags_s[i], self.y[rows], self.A[square],
            np.ascontiguousarray(self.B[square]), np.ascontiguousarray(self.path[square]), self.doubt[square],
            self.tops,
        )  # fmt: skip

    def distances2(self) -> list[float]:
        """Return each sighting's squared Mahalanobis distance (n,), as far as the envelope goes; inf where unseen."""
        S = self.A + self.tops[0] * self.B[0] + self.tops[1] * self.B[1]
        found = []
        for i in range(0, len(self.y), 2):
            (a, b), (_, d), (u, v) = S[i, i : i + 2].tolist(), S[i + 1, i : i + 2].tolist(), self.y[i : i + 2].tolist()
            found.append((d * u * u - 2.0 * b * u * v + a * v * v) / (a * d - b * b))
        return found


def make_batch(ahead: Prediction, sightings: tuple[BallSighting, ...], rig: Rig) -> Batch:
    """Compare sightings with a prediction. A ball predicted behind its camera has NaN for an innovation."""
    state, T = ahead.state, ahead.process.manoeuvre_s
    cameras = np.array([s.camera for s in sightings])
    balls = np.array([s.ball for s in sightings])
    lags_s = np.array([s.t_ns - state.t_ns for s in sightings]) * 1e-9
    z = np.concatenate([s.uv_px for s in sightings])
    R = np.diag(np.repeat(state.noise[cameras, 0], 2))
    for i, sighting in enumerate(sightings):
        R[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] += sighting.cov_px
    h, H = pixels(state.mean, T, cameras, balls, lags_s, camera_table(rig), marker_points(rig))
    size, true_lags_s = len(state.P), lags_s + state.offsets_s[cameras]
    path = np.stack([path_noise(H, cameras, true_lags_s, T, first) for first in (0, 3)])
    Q = (process_noise(size, ahead.dt, T, 1.0, 0.0), process_noise(size, ahead.dt, T, 0.0, 1.0))
    B = np.stack([innovation_covariance(H, unit, own) for unit, own in zip(Q, path, strict=True)])
    doubt = _doubt(ahead, H, cameras)
    A = innovation_covariance(H, ahead.P_coasted, R + doubt)
    tops = variances(ahead.process)[:, -1]
    return Batch(sightings, z, R, cameras, balls, lags_s, z - h, A, B, path, doubt, tops)


def _doubt(ahead: Prediction, H: Array, cameras: Indices) -> Array:
    """Return the covariance (2n, 2n) [px^2] of unknown speed times unknown clock offset.

    Source: a pixel goes by J (v + dv) (o + do). dv do is of second order, and no slope at v = 0, o = 0 shows it; its
        covariance is J P_vv J' P_oo, the two being independent at first; the same for the body's turn.
    """
    P = ahead.P_coasted
    doubt = np.zeros((len(H), len(H)))
    owners = np.repeat(cameras, 2)
    for camera in range(1, len(P) - OFFSETS + 1):
        variance = P[OFFSETS + camera - 1, OFFSETS + camera - 1]
        rows = np.flatnonzero(owners == camera)
        if variance == 0.0 or len(rows) == 0:
            continue
        J, L = H[rows, POSITION], H[rows, ATTITUDE]
        doubt[rows[:, None], rows] = variance * (J @ P[VELOCITY, VELOCITY] @ J.T + L @ P[RATE, RATE] @ L.T)
    return doubt
