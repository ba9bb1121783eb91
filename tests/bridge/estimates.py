"""Estimates for the bridge's tests."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bridge.wire import Message
from tracker.types import Array, Estimate, Step, TrackState, frozen_array

SMALL_COVARIANCE = frozen_array(np.diag([1e-4] * 3 + [1e-3] * 3 + [1e-2] * 6))


def estimate(
    t_ns: int = 1_000_000_000,
    p_BinW: ArrayLike = (0.0, 0.0, 0.0),
    R_BtoW: ArrayLike | None = None,
    v_BinW: ArrayLike = (0.0, 0.0, 0.0),
    covariance: ArrayLike = SMALL_COVARIANCE,
    reset_counter: int = 0,
    available_ns: int = 0,
) -> Estimate:
    """Return an estimate, level, at rest at the room's origin unless told otherwise."""
    return Estimate(
        t_ns=t_ns,
        p_BinW=frozen_array(p_BinW),
        R_BtoW=frozen_array(np.eye(3) if R_BtoW is None else R_BtoW),
        v_BinW=frozen_array(v_BinW),
        w_BinB=frozen_array(np.zeros(3)),
        covariance=frozen_array(covariance),
        state=TrackState.TRACKING,
        reset_counter=reset_counter,
        available_ns=available_ns,
    )


def step(*estimates: Estimate) -> Step:
    """Return the step that brings these estimates."""
    return Step(TrackState.TRACKING, estimates=estimates)


def random_covariance(generator: np.random.Generator, size: int) -> Array:
    """Return a well-conditioned full covariance (size, size), about 1e-3 on its diagonal."""
    root = generator.normal(size=(size, 2 * size))
    return np.asarray(root @ root.T) * (1e-3 / (2 * size))


def beat(t_ns: int) -> Message:
    """Return some small message that speaks of t_ns."""
    fields = {"type": 18, "autopilot": 8, "base_mode": 0, "custom_mode": t_ns, "system_status": 4, "mavlink_version": 3}
    return Message("HEARTBEAT", t_ns, 0, fields)
