"""What two runs differ in: error, lag, NIS, latency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from tools.compare.flown import Flown, Path7
from tools.export.resample import Times
from tracker.errors import OperatorError
from tracker.types import Array

LAG_RATE_HZ = 200.0
LONGEST_LAG_S = 0.5
LEAST_OVERLAP_S = 2.0
LEAST_SPEED_SD_M_S = 0.02
EDGE_NS = 300_000_000  # of the path beside the stretch, so that the spline runs on
BAND = (0.025, 0.975)


@dataclass(frozen=True, slots=True, eq=False)
class Difference:
    """One path less another, at the first one's times. Those where the other says nothing are left out.

    t_ns: (n,).  position_m: (n, 3) in W.  turn_rad: (n,) angle between the attitudes.
    lag_ms: how much later the first one moves, None where it hardly moves or they overlap for too short a time.
    """

    t_ns: Times
    position_m: Array
    turn_rad: Array
    lag_ms: float | None

    @property
    def distance_mm(self) -> Array:
        """How far apart they are (n,) [mm]."""
        return np.asarray(np.linalg.norm(self.position_m, axis=1) * 1e3)


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Two runs. between: B less A.  truths: A and B less the truth, None without one.

    same_bytes: whether both sent the same MAVLink frames in the same order; None where one sent none.
    """

    a: Flown
    b: Flown
    between: Difference
    truths: tuple[Difference, Difference] | None
    same_bytes: bool | None


def compare(a: Flown, b: Flown, truth: Path7 | None) -> Comparison:
    """Lay two runs beside each other.

    Raises:
        OperatorError: they share no time with each other, or one shares none with the truth.
    """
    between = difference(b.path, a.path, f"{b.name} and {a.name}")
    truths = None
    if truth is not None:
        left, right = (difference(one.path, truth, f"{one.name} and the truth") for one in (a, b))
        truths = left, right
    return Comparison(a, b, between, truths, a.wire == b.wire if a.wire and b.wire else None)


def difference(path: Path7, reference: Path7, names: str) -> Difference:
    """Return a path less a reference.

    Raises:
        OperatorError: no time in common.
    """
    there = reference.at(path.t_ns)
    known = np.isfinite(there).all(axis=1) & np.isfinite(path.poses).all(axis=1)
    if not known.any():
        spans = " and ".join(f"{p.t_ns[0] / 1e9:.3f} to {p.t_ns[-1] / 1e9:.3f} s" for p in (path, reference))
        raise OperatorError(f"compare: {names} share no time ({spans} of stream time); name runs of the same frames")
    here, there = path.poses[known], there[known]
    q_here, q_there = (Rotation.from_quat(poses[:, 3:], scalar_first=True) for poses in (here, there))
    turn_rad = (q_there.inv() * q_here).magnitude()
    return Difference(path.t_ns[known], here[:, :3] - there[:, :3], turn_rad, lag_ms(path, reference))


def lag_ms(path: Path7, reference: Path7) -> float | None:
    """Return how much later a path moves than a reference, by the peak of their speeds' cross-correlation [ms].

    Speeds are those of cubic splines through the positions (straight lines have steps in their speed, all at the
    samples' own times, and would pull the lag towards whole periods), drawn at 200 Hz over the longest stretch that
    both know. The peak is that of a parabola through the three highest coefficients. Positive: the path is late.
    """
    step_ns = 1e9 / LAG_RATE_HZ
    start, end = max(path.t_ns[0], reference.t_ns[0]), min(path.t_ns[-1], reference.t_ns[-1])
    grid_ns = np.arange(start, end, step_ns).astype(np.int64)
    if len(grid_ns) < 2:
        return None
    places = [one.at(grid_ns)[:, :3] for one in (path, reference)]
    known: NDArray[np.bool_] = np.asarray(np.isfinite(np.hstack(places)).all(axis=1))
    stretch = _longest(known)
    if stretch.stop - stretch.start < LEAST_OVERLAP_S * LAG_RATE_HZ:
        return None
    speeds = [_speed(one, grid_ns[stretch]) for one in (path, reference)]
    if min(float(speed.std()) for speed in speeds) < LEAST_SPEED_SD_M_S:
        return None
    reach = min(round(LONGEST_LAG_S * LAG_RATE_HZ), len(speeds[0]) // 4)
    middle = slice(reach, len(speeds[1]) - reach)
    likeness = np.array(
        [
            np.corrcoef(speeds[0][middle.start + lag : middle.stop + lag], speeds[1][middle])[0, 1]
            for lag in range(-reach, reach + 1)
        ]
    )
    top = int(np.argmax(likeness))
    if top in (0, 2 * reach):
        return None
    below, peak, above = likeness[top - 1 : top + 2]
    return float(top - reach + 0.5 * (below - above) / (below - 2 * peak + above)) * 1e3 / LAG_RATE_HZ


def nis_share(one: Flown) -> tuple[float, float] | None:
    """Return the mean NIS per degree of freedom, and the share of updates inside their own 95 % band; None for none."""
    used = one.nis_dof > 0
    if not used.any():
        return None
    nis, dof = one.nis[used], one.nis_dof[used]
    low, high = chi2.ppf(BAND[0], dof), chi2.ppf(BAND[1], dof)
    return float(nis.sum() / dof.sum()), float(np.mean((nis >= low) & (nis <= high)))


def _speed(path: Path7, grid_ns: Times) -> Array:
    """Return the speed (n,) at times between which the path has no gap [m/s]."""
    near = (path.t_ns >= grid_ns[0] - EDGE_NS) & (path.t_ns <= grid_ns[-1] + EDGE_NS)
    seconds = (path.t_ns[near] - grid_ns[0]) / 1e9
    velocity = CubicSpline(seconds, path.poses[near, :3])((grid_ns - grid_ns[0]) / 1e9, 1)
    return np.asarray(np.linalg.norm(velocity, axis=1))


def _longest(known: NDArray[np.bool_]) -> slice:
    """Return the longest stretch of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], known, [False])).astype(np.int8)))
    if not len(edges):
        return slice(0, 0)
    starts, ends = edges[::2], edges[1::2]
    best = int(np.argmax(ends - starts))
    return slice(int(starts[best]), int(ends[best]))
