"""What later sightings say of an earlier state: a smoother, backwards over some updates.

A filter goes by the past alone. Free-running cameras show this most: each is asked for the vehicle at its own instant,
and half of what tells its place was seen half a frame before. One round later the other camera has looked from both
sides of that instant, and little is left to be guessed. Speeds and rates gain most: what comes before and after tells
them, not the last step alone.

Source: Rauch, Tung, Striebel, "Maximum likelihood estimates of linear dynamic systems", AIAA Journal 3 (1965): with
    C = P F' P_ahead^-1, a state gains C times what the later one turned out off its prediction, and its covariance
    C (P_later - P_ahead) C' (1). That attitude's errors are told of slightly different attitudes is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tracker.filter.ekf import Update
from tracker.filter.matern import carried
from tracker.state import State
from tracker.types import Array


def smoothed(updates: Sequence[Update]) -> State:
    """Return the state after the first of some updates that follow each other, as the others show it.

    They tell of it as far as each was predicted from the one before, with no turn open between.
    """
    state = updates[-1].state
    for i in range(len(updates) - 2, -1, -1):
        before, P_ahead = updates[i].state, updates[i + 1].P_ahead
        state = before if P_ahead is None else _told_by(before, P_ahead, state)
    return state


def _told_by(before: State, P_ahead: Array, later: State) -> State:
    """Return a state as a later one tells of it (1) that was predicted from it with covariance P_ahead (n, n)."""
    dt = (later.t_ns - before.t_ns) * 1e-9
    mean, F = carried(before.mean, dt, before.manoeuvre_s, len(P_ahead))
    variance = np.diag(P_ahead)
    known = variance <= 0.0  # the clocks of triggered cameras: nothing is learned of them
    sigma = np.sqrt(np.where(known, 1.0, variance))  # told in these, metres and jerks can stand side by side
    both = np.outer(sigma, sigma)
    gain = np.linalg.solve(P_ahead / both + np.diag(known), F @ before.P / sigma[:, None]).T
    off = replace(before, mean=mean).error_to(later)
    P = before.P + gain @ ((later.P - P_ahead) / both) @ gain.T
    return replace(before.moved(gain @ (off / sigma)), P=(P + P.T) / 2.0)
