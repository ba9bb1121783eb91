"""How late the bridge's stamps are, found from its attitudes and the autopilot's gyro during a wiggle by hand."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

from tracker.maths import so3
from tracker.types import Array

EARLIEST_S, LATEST_S = -0.3, 0.5  # lateness looked for; ArduPilot's VISO_DELAY_MS ends at 250 ms
GRID_S = 0.005
LEAST_RATE_RAD_S = 0.3  # rms; slower wiggles drown in the attitude's noise
LEAST_CORRELATION = 0.8
MOST_SIGMA_S = 0.005
LEAST_POSES = 30
LONGEST_STEP_S = 0.25  # increments over longer gaps are left out
SECOND_AXIS = 0.02  # share of the motion a second axis needs before the axes themselves can be compared
NEIGHBOURS = 8  # of the residuals, whose correlation is counted


@dataclass(frozen=True, slots=True)
class TooLittle:
    """Why no delay could be found."""

    why: str


@dataclass(frozen=True, slots=True, eq=False)
class Delay:
    """What the wiggle showed.

    late_s: stamp minus the true instant of the attitude, negative for stamps that are early; sigma_s: one sigma [s].
    correlation: of the two motions, 1 for the same.  rate_rad_s: rms of the gyro.
    R_GtoF: the gyro's axes in the bridge's body axes, None when the motion had one axis only.
    """

    late_s: float
    sigma_s: float
    correlation: float
    rate_rad_s: float
    R_GtoF: Array | None

    @property
    def turned_deg(self) -> float | None:
        """How far the gyro's axes and the bridge's are turned against each other, None when not seen [deg]."""
        return None if self.R_GtoF is None else float(np.degrees(np.linalg.norm(so3.log(self.R_GtoF))))


def find_delay(
    pose_t_ns: Sequence[int], R_FtoN: Sequence[Array], gyro_t_ns: Sequence[int], w_G: Sequence[Array]
) -> Delay | TooLittle:
    """Find by how much the attitudes' stamps are late against the gyro's.

    Args:
        pose_t_ns, R_FtoN: stamps [ns] and attitudes (3, 3) of the bridge's poses, in order.
        gyro_t_ns, w_G: times on the same clock [ns] and rates (3,) of the gyro, in order [rad/s].
    Source: between two stamps the attitude turns by y = log(R_k' R_k+1), the gyro by x = integral of w over the same
        time moved back by the lateness L; y = R x + b dt + noise. No rate is differenced or filtered, so no filter's
        lag is taken for delay. For every L the best R is Kabsch's; least squares over L, then Gauss-Newton's
        covariance, with the residuals' correlation counted (Newey and West, Econometrica 55, 1987).
    """
    series = _Series.of(pose_t_ns, R_FtoN, gyro_t_ns, w_G)
    if isinstance(series, TooLittle):
        return series
    grid = np.arange(EARLIEST_S, LATEST_S + GRID_S / 2, GRID_S)
    costs = [series.cost(late_s) for late_s in grid]
    best = int(np.argmin(costs))
    if best in (0, len(grid) - 1):
        return TooLittle(f"no delay from {1e3 * EARLIEST_S:.0f} to {1e3 * LATEST_S:.0f} ms makes the motions agree")
    found = minimize_scalar(series.cost, bounds=(grid[best - 1], grid[best + 1]), method="bounded")
    delay = series.delay(float(found.x))
    if delay.correlation < LEAST_CORRELATION:
        return TooLittle(
            f"the motions agree by {100 * delay.correlation:.0f} % only, {100 * LEAST_CORRELATION:.0f} % are needed: "
            "is it this vehicle's autopilot?"
        )
    if delay.sigma_s > MOST_SIGMA_S:
        return TooLittle(f"delay uncertain by {1e3 * delay.sigma_s:.1f} ms: wiggle more briskly or for longer")
    return delay


class _Series:
    """The two motions, ready to be laid over each other.

    start_s, end_s: (n,) times between which y (n, 3) [rad] was turned.  gyro: its rate as a spline.
    """

    def __init__(self, start_s: Array, end_s: Array, y: Array, gyro: CubicSpline) -> None:
        self._start_s, self._end_s, self._y = start_s, end_s, y
        self._gyro = gyro
        self._angle = gyro.antiderivative()

    @classmethod
    def of(
        cls, pose_t_ns: Sequence[int], R_FtoN: Sequence[Array], gyro_t_ns: Sequence[int], w_G: Sequence[Array]
    ) -> _Series | TooLittle:
        """Make the series, or say why there is none."""
        if len(pose_t_ns) < LEAST_POSES or len(gyro_t_ns) < LEAST_POSES:
            return TooLittle(
                f"{len(pose_t_ns)} poses and {len(gyro_t_ns)} gyro readings; {LEAST_POSES} of each are needed"
            )
        origin_ns = int(gyro_t_ns[0])
        gyro_s, kept = np.unique((np.asarray(gyro_t_ns) - origin_ns) / 1e9, return_index=True)
        pose_s = (np.asarray(pose_t_ns) - origin_ns) / 1e9
        y = np.array([so3.log(before.T @ after) for before, after in itertools.pairwise(R_FtoN)])
        start_s, end_s = pose_s[:-1], pose_s[1:]
        inside = (start_s - LATEST_S > gyro_s[0]) & (end_s - EARLIEST_S < gyro_s[-1])
        inside &= (end_s > start_s) & (end_s - start_s < LONGEST_STEP_S)
        if np.count_nonzero(inside) < LEAST_POSES:
            return TooLittle("poses and gyro overlap for too short a time")
        series = cls(start_s[inside], end_s[inside], y[inside], CubicSpline(gyro_s, np.asarray(w_G)[kept]))
        if series.rate_rad_s < LEAST_RATE_RAD_S:
            return TooLittle(
                f"it turned at {series.rate_rad_s:.2f} rad/s only, {LEAST_RATE_RAD_S:g} are needed: wiggle more briskly"
            )
        return series

    @property
    def rate_rad_s(self) -> float:
        """Rms rate of the gyro during the poses, its mean taken off [rad/s]."""
        w = np.asarray(self._gyro(self._start_s))
        return float(np.sqrt(np.mean(np.sum((w - w.mean(axis=0)) ** 2, axis=1))))

    def cost(self, late_s: float) -> float:
        """Return the sum of squares left at a lateness, with the best rotation and bias [rad^2]."""
        x, y = self._centred(late_s)
        _, agreement = _best_rotation(x, y)
        return float(np.sum(x * x) + np.sum(y * y) - 2.0 * agreement)

    def delay(self, late_s: float) -> Delay:
        """Return all there is to say at the best lateness."""
        x, y = self._centred(late_s)
        R, agreement = _best_rotation(x, y)
        correlation = agreement / math.sqrt(float(np.sum(x * x) * np.sum(y * y)))
        strengths = np.linalg.svd(x, compute_uv=False) ** 2
        seen = bool(strengths[1] > SECOND_AXIS * strengths[0])
        return Delay(late_s, self._sigma_s(late_s, x, y, R, seen), correlation, self.rate_rad_s, R if seen else None)

    def _centred(self, late_s: float) -> tuple[Array, Array]:
        """Return gyro's and bridge's turns (n, 3) [rad], each less its mean rate: the gyro's bias falls out."""
        x = np.asarray(self._angle(self._end_s - late_s) - self._angle(self._start_s - late_s))
        share = (self._end_s - self._start_s) / np.sum(self._end_s - self._start_s)
        return x - np.outer(share, x.sum(axis=0)), self._y - np.outer(share, self._y.sum(axis=0))

    def _sigma_s(self, late_s: float, x: Array, y: Array, R: Array, turns: bool) -> float:
        """Return one sigma of the lateness [s]: sandwich covariance over lateness, bias and, if seen, rotation."""
        ahead = np.asarray(self._gyro(self._start_s - late_s) - self._gyro(self._end_s - late_s)) @ R.T
        dt = self._end_s - self._start_s
        columns = [ahead, *(np.outer(dt, axis) for axis in np.eye(3))]
        if turns:
            columns += [np.cross(axis, x @ R.T) for axis in np.eye(3)]
        J = np.stack(columns, axis=2)  # (n, 3, p)
        scores = np.einsum("nip,ni->np", J, y - x @ R.T)
        inverse = np.linalg.pinv(np.einsum("nip,niq->pq", J, J))
        middle = scores.T @ scores
        for lag in range(1, NEIGHBOURS + 1):
            product = scores[lag:].T @ scores[:-lag]
            middle += (1.0 - lag / (NEIGHBOURS + 1.0)) * (product + product.T)
        return math.sqrt(max(float((inverse @ middle @ inverse)[0, 0]), 0.0))


def _best_rotation(x: Array, y: Array) -> tuple[Array, float]:
    """Return the rotation R that brings x onto y best, and the sum of y . R x.

    Motion about one axis leaves the turn about that axis open; then the R nearest to none is not sought: any will do.
    Source: Kabsch, Acta Cryst. A32 (1976) 922.
    """
    U, strengths, V = np.linalg.svd(y.T @ x)
    signs = np.array([1.0, 1.0, float(np.sign(np.linalg.det(U @ V)))])
    return (U * signs) @ V, float(strengths @ signs)
