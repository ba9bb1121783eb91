"""The sightings of one round as arrays, and what a prediction says of them."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tracker.filter.clocks import given_clocks
from tracker.filter.correction import gathered_noise, path_noise
from tracker.filter.manoeuvre import envelope
from tracker.filter.matern import MOTIONS, unit_noise
from tracker.filter.measure import Indices, camera_table, pixels
from tracker.filter.noise import ALIKE, APART
from tracker.filter.predict import Prediction
from tracker.filter.sag import sag_noise
from tracker.maths.compiled import compiled
from tracker.maths.covariance import propagated
from tracker.rig import Rig
from tracker.state import OFFSETS
from tracker.types import Array, BallSighting


class Sighted(NamedTuple):
    """Sightings as arrays.

    cameras, balls, lags_s: (n,) of each; the lag is its stamp after the prediction's time [s].
    z: (2n,) pixels.  covs_px: (2n, 2) the fits' own covariances, one below the other [px^2].
    """

    sightings: tuple[BallSighting, ...]
    cameras: Indices
    balls: Indices
    lags_s: Array
    z: Array
    covs_px: Array

    def part(self, kept: list[int]) -> Sighted:
        """Return the sightings of these indices."""
        i, rows = np.array(kept), _rows_of(kept)
        sightings = tuple(self.sightings[k] for k in kept)
        return Sighted(
            sightings, self.cameras[i], self.balls[i], self.lags_s[i], self.z[rows], self.covs_px[rows]
        )  # fmt: skip


def sighted(sightings: tuple[BallSighting, ...], t_ns: int) -> Sighted:
    """Return sightings, at least one, as arrays for a prediction to t_ns."""
    seen_by, seen, stamps_ns, uvs_px, covs_px2 = zip(*sightings, strict=True)
    lags_s = np.array([(stamp_ns - t_ns) * 1e-9 for stamp_ns in stamps_ns])
    return Sighted(
        sightings, _indices(seen_by), _indices(seen), lags_s, np.concatenate(uvs_px), np.concatenate(covs_px2)
    )  # fmt: skip


@lru_cache(maxsize=256)
def _indices(numbers: tuple[int, ...]) -> Indices:
    """Return numbers as an array, only to be read: nearly every round sees the same balls in the same cameras."""
    return np.array(numbers)


class Batch(NamedTuple):
    """Sightings, and what a prediction says of them.

    R (2n, 2n): the noise of fit and camera.
    y (2n,): the prediction's innovation.  H (2n, size): its slope.  A (2n, 2n): its covariance without any manoeuvre.
    B (s, 2n, 2n): what each strength of 1 adds to it, (s,) as `process_noise` takes them.
    path (s, 2n, 2n): the part of B that lies between the state's time and the cameras'.
    doubt (2n, 2n): unknown speed times unknown clock offset, part of A.
    tops (s,): the envelope's strengths.
    """

    sighted: Sighted
    R: Array
    y: Array
    H: Array
    A: Array
    B: Array
    path: Array
    doubt: Array
    tops: Array

    def part(self, kept: list[int]) -> Batch:
        """Return the batch with only the sightings of these indices."""
        if len(kept) == len(self.sighted.sightings):
            return self
        rows = _rows_of(kept)
        square = (..., rows[:, None], rows)
        return Batch(
            self.sighted.part(kept), self.R[square], self.y[rows], self.H[rows], self.A[square],
            np.ascontiguousarray(self.B[square]), np.ascontiguousarray(self.path[square]), self.doubt[square],
            self.tops,
        )  # fmt: skip

    def distances2(self) -> list[float]:
        """Return each sighting's squared Mahalanobis distance (n,), as far as the envelope goes; inf where unseen."""
        found: list[float] = distances2(self.y, self.A, self.B, self.tops).tolist()
        return found


def _rows_of(kept: list[int]) -> Indices:
    """Return the rows of some sightings' pixels, two for each."""
    i = np.array(kept)
    return np.stack((2 * i, 2 * i + 1), axis=1).reshape(-1)


def make_batch(ahead: Prediction, seen: Sighted, rig: Rig) -> Batch:
    """Compare sightings with a prediction. A ball predicted behind its camera has NaN for an innovation."""
    state, T = ahead.state, ahead.process.manoeuvre_s
    y, H, R, A, B, path, doubt = compared(
        state.mean, state.P, ahead.P_coasted, ahead.dt, T, seen.z, seen.covs_px, state.noise, seen.cameras, seen.balls,
        seen.lags_s, camera_table(rig), ahead.points_of(rig), ahead.turn_open,
    )  # fmt: skip
    return Batch(seen, R, y, H, A, B, path, doubt, envelope(ahead.process))


@compiled("f8[::1](f8[::1], f8[:, ::1], f8[:, :, ::1], f8[::1])")
def distances2(y: Array, A: Array, B: Array, tops: Array) -> Array:
    """Return y' S^-1 y (n,) of each sighting's 2 x 2 block."""
    found = np.empty(len(y) // 2)
    for s in range(len(found)):
        i = 2 * s
        a, b, d = A[i, i], A[i, i + 1], A[i + 1, i + 1]
        for k in range(len(B)):
            a, b, d = a + tops[k] * B[k, i, i], b + tops[k] * B[k, i, i + 1], d + tops[k] * B[k, i + 1, i + 1]
        u, v = y[i], y[i + 1]
        found[s] = (d * u * u - 2.0 * b * u * v + a * v * v) / (a * d - b * b)
    return found


@compiled("f8[:, ::1](f8[:, ::1], f8[:, ::1], f8[:, ::1], i8[::1])")
def _doubt(P: Array, known: Array, H: Array, cameras: Indices) -> Array:
    """Return the covariance (2n, 2n) [px^2] of unknown speed times unknown clock offset.

    Source: a pixel goes by J (v + dv) (o + do). dv do is of second order, and no slope at v = 0, o = 0 shows it; its
        covariance is J P_vv J' P_oo, the two being independent at first; the same for the body's turn.
    """
    doubt = np.zeros((len(H), len(H)))
    for i in range(len(H)):
        camera = cameras[i // 2]
        variance = P[OFFSETS + camera - 1, OFFSETS + camera - 1] if camera > 0 else 0.0
        if variance == 0.0:
            continue
        for j in range(len(H)):
            if cameras[j // 2] == camera:
                for k in range(3):
                    for m in range(3):
                        speed = H[i, k] * known[6 + k, 6 + m] * H[j, m]
                        doubt[i, j] += variance * (speed + H[i, 3 + k] * known[9 + k, 9 + m] * H[j, 3 + m])
    return doubt


@compiled("Tuple((f8[:, ::1], f8[:, ::1], f8[:, :, ::1], f8[:, :, ::1], f8[:, ::1]))"
          "(f8[:, ::1], f8[:, ::1], f8, f8, f8[:, ::1], f8[:, ::1], i8[::1], f8[::1])")  # fmt: skip
def _covariances(
    H: Array, P: Array, dt: float, T: float, covs_px: Array, noise: Array, cameras: Indices, lags_s: Array
) -> tuple[Array, Array, Array, Array, Array]:
    """Return R, A, B, path and doubt of a `Batch`.

    Args:
        H (2n, size), P: slope of the sightings and coasted covariance.  covs_px: (2n, 2) the fits' own, one below the
        other.  noise: `State.noise`.  lags_s: (n,) of each sighting's true time after the state's.
    """
    rows = len(H)
    R = np.zeros((rows, rows))
    for i in range(rows):
        first = i - i % 2
        R[i, first], R[i, first + 1] = covs_px[i, 0], covs_px[i, 1]
        R[i, i] += noise[cameras[i // 2], APART]
        for j in range(i % 2, rows, 2):
            if cameras[j // 2] == cameras[i // 2]:
                R[i, j] += noise[cameras[i // 2], ALIKE]
    path = path_noise(H, cameras, lags_s, T)
    B, unit = np.empty(path.shape), unit_noise(dt, T)
    for k in range(len(B)):
        B[k] = path[k] + gathered_noise(H, unit[k // MOTIONS], k % MOTIONS)
    doubt = _doubt(P, given_clocks(P), H, cameras)
    return R, propagated(H, P, R + doubt), B, path, doubt


@compiled("Tuple((f8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, :, ::1], f8[:, :, ::1], f8[:, ::1]))"
          "(f8[::1], f8[:, ::1], f8[:, ::1], f8, f8, f8[::1], f8[:, ::1], f8[:, ::1], i8[::1], i8[::1], f8[::1],"
          " f8[:, ::1], f8[:, ::1], b1)")  # fmt: skip
def compared(
    mean: Array, P: Array, P_coasted: Array, dt: float, T: float, z: Array, covs_px: Array, noise: Array,
    cameras: Indices, balls: Indices, lags_s: Array, table: Array, points_inB: Array, turn_open: bool,
) -> tuple[Array, Array, Array, Array, Array, Array, Array]:  # fmt: skip
    """Return y, H, R, A, B, path and doubt of a `Batch`.

    Args:
        mean, P, P_coasted, dt, turn_open: of the `Prediction`.  z, cameras, balls, lags_s: the batch's.
        covs_px, noise: as `_covariances` takes them.  T, table, points_inB: as `pixels` does.
    """
    h, H = pixels(mean, T, cameras, balls, lags_s, table, points_inB)
    true_lags_s = np.empty(len(lags_s))
    for s in range(len(lags_s)):
        true_lags_s[s] = lags_s[s] + mean[30 + cameras[s]]
    R, A, B, path, doubt = _covariances(H, P_coasted, dt, T, covs_px, noise, cameras, true_lags_s)
    if turn_open:
        A += sag_noise(H, balls, points_inB, mean, P)
    return z - h, H, R, A, B, path, doubt
