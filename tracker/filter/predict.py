"""Carry the track on to a new time."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tracker.filter import manoeuvre
from tracker.filter.manoeuvre import expected, later
from tracker.filter.matern import carried, process_noise
from tracker.filter.measure import marker_points
from tracker.filter.pivot import best_known, moved_to
from tracker.maths.compiled import compiled
from tracker.rig import Rig
from tracker.state import OFFSETS, Process, State
from tracker.types import Array

ORIGIN: Array = np.zeros(3)
OFFSET_WALK = 2e-5  # of a clock offset [s / sqrt s]: crystals drift


class Prediction(NamedTuple):
    """A state carried on, before it is known how brisk the manoeuvre was meanwhile.

    state: with the covariance that is expected, for who looks for the balls.
    P_coasted: (n, n) covariance without any manoeuvre.  dt: time since the last update [s].
    pivot_inB: (3,) the point of the body that was known best before [m], ORIGIN where no turn was open.
    """

    state: State
    P_coasted: Array
    dt: float
    process: Process
    pivot_inB: Array = ORIGIN

    @property
    def turn_open(self) -> bool:
        """Say whether a turn about the pivot was open."""
        return self.pivot_inB is not ORIGIN

    def points_of(self, rig: Rig) -> Array:
        """Return the balls' centres (n, 3) from the pivot, along B's axes [m]."""
        points_inB = marker_points(rig)
        return points_inB - self.pivot_inB if self.turn_open else points_inB

    def about_pivot(self) -> Prediction:
        """Return the same prediction, its state and covariances told of the pivot instead of the origin."""
        if not self.turn_open:
            return self
        mean, P, P_coasted = _told_of(self.state.mean, self.pivot_inB, self.state.P, self.P_coasted)
        state = replace(self.state, mean=mean, P=P)
        return Prediction(state, P_coasted, self.dt, self.process, self.pivot_inB)


def predict(state: State, t_ns: int, process: Process) -> Prediction:
    """Carry a state and its covariance on to t_ns, which is not before the state's own time."""
    dt = (t_ns - state.t_ns) * 1e-9
    if dt < 0.0:
        raise ValueError(f"cannot predict back by {-dt} s")
    walk = OFFSET_WALK**2 * dt if process.clock_offset_s > 0.0 else 0.0
    of = manoeuvre.strengths(process)
    mean, P_coasted, P, levels, pivot_inB, turn_open = _ahead(
        state.mean, state.P, state.levels, of, dt, process.manoeuvre_s, walk
    )  # fmt: skip
    ahead = State(t_ns, mean, P, levels, state.noise, state.manoeuvre_s)
    return Prediction(ahead, P_coasted, dt, process, pivot_inB if turn_open else ORIGIN)


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


@compiled("f8[:, ::1](f8[:, ::1], f8[:, ::1])")
def _conjugated(F: Array, P: Array) -> Array:
    """Return F P F' (n, n)."""
    return _sparse_product(F, _sparse_product(F, P).T.copy())


@compiled("Tuple((f8[::1], f8[:, ::1], f8[:, ::1]))(f8[::1], f8[::1], f8[:, ::1], f8[:, ::1])")
def _told_of(mean: Array, point_inB: Array, P: Array, P_coasted: Array) -> tuple[Array, Array, Array]:
    """Return a mean and two covariances, told of another point of the body."""
    moved, J = moved_to(mean, point_inB, len(P))
    return moved, _conjugated(J, P), _conjugated(J, P_coasted)


@compiled("Tuple((f8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[::1], b1))"
          "(f8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], f8, f8, f8)")  # fmt: skip
def _ahead(
    mean: Array, P: Array, levels: Array, of: Array, dt: float, T: float, walk: float
) -> tuple[Array, Array, Array, Array, Array, bool]:
    """Return mean, coasted covariance F P F', that with the expected manoeuvre, and levels, after dt; then the pivot.

    And whether a turn is open: without one there is no pivot, and the state stays told of the origin.

    of: strengths of the levels.  walk: variance that each clock offset gains [s^2].
    """
    size, pivot = len(P), best_known(mean, P)
    turn_open = bool(pivot.any())
    if turn_open:
        start, there = moved_to(mean, pivot, size)
        after, F = carried(start, dt, T, size)
        F = _sparse_product(F, there)
    else:
        after, F = carried(mean, dt, T, size)
    coasted = _conjugated(F, P)
    for i in range(OFFSETS, size):
        coasted[i, i] += walk
    then = later(levels, dt)
    P_then = coasted + process_noise(size, dt, T, expected(then, of))
    if turn_open:
        after, coasted, P_then = _told_of(after, -pivot, coasted, P_then)
    return after, coasted, P_then, then, pivot, turn_open


def first_guess(state: State, process: Process) -> Prediction:
    """Take a state found in whole frames for a prediction."""
    return Prediction(state, state.P, 0.0, process)


def at_origin(state: State, pivot_inB: Array) -> State:
    """Return a state that is told of a point of the body as that of the body's origin."""
    if pivot_inB is ORIGIN:
        return state
    mean, P, _ = _told_of(state.mean, -pivot_inB, state.P, state.P)
    return replace(state, mean=mean, P=P)
