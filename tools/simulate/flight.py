"""A simulated flight as arrays: what was commanded, what was true, what was estimated."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tools.simulate.world import Moment
from tracker.maths import so3
from tracker.sources.paths import Pose
from tracker.types import Array, Estimate


@dataclass(frozen=True, slots=True, eq=False)
class Flight:
    """The whole flight; n autopilot ticks, m estimates. Times count from the first tick [s].

    t_s (n,), phase (n,), p_BinW (n, 3), commanded_inW (n, 3) [m], euler (n, 3) roll, pitch, yaw [rad].
    estimated_s (m,), estimated_inW (m, 3) [m], estimated_euler (m, 3) [rad].
    error_inW (m, 3): estimate less truth [m].  turn_error (m, 3): rotation vector from true to estimated [rad].
    sigma_m (m, 3), sigma_rad (m, 3): one sigma of both as the filter reports them.
    latency_ms (k,): frame in memory to datagram with the kernel.  landed: the mission came to its end.
    """

    t_s: Array
    phase: NDArray[np.str_]
    p_BinW: Array
    commanded_inW: Array
    euler: Array
    estimated_s: Array
    estimated_inW: Array
    estimated_euler: Array
    error_inW: Array
    turn_error: Array
    sigma_m: Array
    sigma_rad: Array
    latency_ms: Array
    corners_inW: Array
    landed: bool


def flight_of(
    history: Sequence[Moment],
    estimates: Sequence[tuple[Estimate, Pose]],
    latency_ms: Sequence[float],
    corners_inW: Array,
    landed: bool,
) -> Flight:
    """Put a flight together.

    Args:
        history: the world's ticks, at least one.
        estimates: each with the true pose at its time.
        latency_ms: one for each message sent [ms].
        corners_inW: (k, 3) the square's corners in the order they are flown [m].
        landed: whether the mission came to its end.
    """
    start_ns = history[0].t_ns
    sigma = np.array([np.sqrt(np.diag(each.covariance)[:6]) for each, _ in estimates]).reshape(-1, 6)
    return Flight(
        t_s=np.array([(moment.t_ns - start_ns) / 1e9 for moment in history]),
        phase=np.array([moment.phase.value for moment in history]),
        p_BinW=np.array([moment.p_BinW for moment in history]),
        commanded_inW=np.array([moment.commanded_inW for moment in history]),
        euler=np.array([so3.to_euler(moment.R_BtoW) for moment in history]),
        estimated_s=np.array([(each.t_ns - start_ns) / 1e9 for each, _ in estimates]),
        estimated_inW=_rows(each.p_BinW for each, _ in estimates),
        estimated_euler=_rows(np.array(so3.to_euler(each.R_BtoW)) for each, _ in estimates),
        error_inW=_rows(each.p_BinW - p_BinW for each, (p_BinW, _) in estimates),
        turn_error=_rows(so3.log(R_BtoW.T @ each.R_BtoW) for each, (_, R_BtoW) in estimates),
        sigma_m=sigma[:, :3],
        sigma_rad=sigma[:, 3:],
        latency_ms=np.array(latency_ms, dtype=np.float64),
        corners_inW=corners_inW,
        landed=landed,
    )


def _rows(vectors: Iterable[Array]) -> Array:
    return np.array(list(vectors), dtype=np.float64).reshape(-1, 3)
