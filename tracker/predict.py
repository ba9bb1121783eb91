"""Carry the track on to a new time."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tracker import manoeuvre
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
    T, size = process.manoeuvre_s, len(state.P)
    mean, F = carried(state.mean, dt, T, size)
    P = F @ state.P @ F.T
    if process.clock_offset_s > 0.0:
        P[range(OFFSETS, size), range(OFFSETS, size)] += OFFSET_WALK**2 * dt
    levels = manoeuvre.later(state.levels, dt)
    Q = process_noise(size, dt, T, *manoeuvre.expected(levels, manoeuvre.variances(process)))
    ahead = replace(state.with_mean(mean), t_ns=t_ns, P=P + Q, levels=levels)
    return Prediction(ahead, P, dt, process)


def first_guess(state: State, process: Process) -> Prediction:
    """Take a state found in whole frames for a prediction."""
    return Prediction(state, state.P, 0.0, process)
