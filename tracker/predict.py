"""Carry the track on to a new time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracker import manoeuvre
from tracker.compiled import compiled
from tracker.manoeuvre import expected, later
from tracker.singer import carried, process_noise
from tracker.state import OFFSETS, Process, State
from tracker.types import Array

OFFSET_WALK = 2e-5  # of a clock offset [s / sqrt s]: crystals drift


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """A state carried on, before it is known how brisk the manoeuvre was meanwhile.

    state: with the covariance that is expected, for who looks for the balls.
    P_coasted: (n, n) covariance without any manoeuvre.  dt: time since the last update [s].
    """

    state: State
    P_coasted: Array
    dt: float
    process: Process


def predict(state: State, t_ns: int, process: Process) -> Prediction:
    """Carry a state and its covariance on to t_ns, which is not before the state's own time."""
    dt = (t_ns - state.t_ns) * 1e-9
    if dt < 0.0:
        raise ValueError(f"cannot predict back by {-dt} s")
    walk = OFFSET_WALK**2 * dt if process.clock_offset_s > 0.0 else 0.0
    of = manoeuvre.variances(process)
    mean, P_coasted, P, levels = _ahead(state.mean, state.P, state.levels, of, dt, process.manoeuvre_s, walk)
    return Prediction(state.at_mean(t_ns, mean, P, levels, state.noise), P_coasted, dt, process)


@compiled("f8[:, ::1](f8[:, ::1], f8[:, ::1])")
def _sparse_product(F: Array, P: Array) -> Array:
    """Return F P (n, n) for an F that is mostly zero."""
    product = np.zeros(P.shape)
    for i in range(len(F)):
        for k in range(len(F)):
            if F[i, k] != 0.0:
                for j in range(len(F)):
                    product[i, j] += F[i, k] * P[k, j]
    return product


@compiled("Tuple((f8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1]))"
          "(f8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], f8, f8, f8)")  # fmt: skip
def _ahead(
    mean: Array, P: Array, levels: Array, of: Array, dt: float, T: float, walk: float
) -> tuple[Array, Array, Array, Array]:
    """Return mean, coasted covariance F P F', covariance with the expected manoeuvre, and levels, after dt.

    of: variances of the levels.  walk: variance that each clock offset gains [s^2].
    """
    size = len(P)
    after, F = carried(mean, dt, T, size)
    coasted = _sparse_product(F, _sparse_product(F, P).T.copy())
    for i in range(OFFSETS, size):
        coasted[i, i] += walk
    then = later(levels, dt)
    translation, rotation = expected(then, of)
    return after, coasted, coasted + process_noise(size, dt, T, translation, rotation), then


def first_guess(state: State, process: Process) -> Prediction:
    """Take a state found in whole frames for a prediction."""
    return Prediction(state, state.P, 0.0, process)
