"""Where the fit starts: equation error, linear least squares on differentiated measurements.

Source: Jategaonkar, "Flight vehicle system identification", 2nd ed. (2015), ch. 6; Klein and Morelli, "Aircraft system
identification" (2006), ch. 5. Differentiated noise biases it, which output error then mends; lags and delay, in which
the equations are not linear, are taken from a grid by what they leave over.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
from scipy.signal import lfilter, savgol_filter

from tools.simulate.dynamics import GRAVITY
from tools.sysid.flight_data import FlightData, Sticks, Track, in_heading, turns
from tools.sysid.parameters import vector
from tracker.types import Array

LAGS_S, DELAYS_S = (0.03, 0.06, 0.12, 0.24), (0.0, 0.04, 0.1)
_GRID_S = 0.01
_WINDOW, _ORDER = 7, 3
_LEAST = 0.5


def starting_point(data: FlightData) -> Array:
    """Return parameters (20,) good enough for output error to start from."""
    tracks = [_Motion(track) for track in data.tracks]
    turning = min(_tilting(tracks, data.sticks), key=lambda each: each[0])
    lifting = min(_heaving(tracks, data.sticks, turning[1]["delay"]), key=lambda each: each[0])
    still = np.vstack([motion.level_rows() for motion in tracks])
    drag = float(np.linalg.lstsq(still[:, :1], still[:, 1], rcond=None)[0][0])
    values = turning[1] | lifting[1] | {"drag": drag}
    trims = {name: value for name, value in values.items() if name.endswith("trim")}
    return vector(**{name: max(value, _least(name)) for name, value in values.items()} | trims)


def _least(name: str) -> float:
    return 0.0 if name in ("delay", "rotor_lag", "lift_lag") else _LEAST


class _Motion:
    """A track differentiated."""

    def __init__(self, track: Track) -> None:
        self.t_s = track.t_s
        step_s = float(np.median(np.diff(track.t_s)))

        def slope(values: Array, order: int = 1) -> Array:
            smooth = savgol_filter(values, _WINDOW, _ORDER, deriv=order, delta=step_s, axis=0)
            return np.asarray(smooth)[_WINDOW:-_WINDOW]

        rates = np.empty((len(track), 3))
        rates[1:-1] = turns(track.R_BtoW[:-2], track.R_BtoW[2:]) / (2.0 * step_s)
        rates[0], rates[-1] = rates[1], rates[-2]
        inner = slice(_WINDOW, -_WINDOW)
        self.inner_s = track.t_s[inner]
        self.up_inB = track.R_BtoW[inner, 2, :]
        self.rates, self.turning = rates[inner], slope(rates)
        velocity, acceleration = slope(track.p_inW), slope(track.p_inW, 2)
        R = track.R_BtoW[inner]
        self.velocity, self.acceleration = in_heading(velocity, R), in_heading(acceleration, R)
        self.tilt = in_heading(R[:, :, 2], R)

    def level_rows(self) -> Array:
        """Return speed backwards and what the tilt does not explain of the acceleration, forward and left (2 m, 2)."""
        rest = (self.acceleration - GRAVITY * self.tilt)[:, :2]
        return np.column_stack((-self.velocity[:, :2].ravel(), rest.ravel()))


def _followed(sticks: Sticks, t_s: Array, lag_s: float, delay_s: float) -> Array:
    """Return the sticks (m, 4) after a first-order lag and a delay."""
    grid_s = np.arange(t_s[0] - 10.0 * lag_s - delay_s - 1.0, t_s[-1] + _GRID_S, _GRID_S)
    given = sticks.mean(grid_s - delay_s - _GRID_S, grid_s - delay_s)
    keep = np.exp(-_GRID_S / lag_s)
    slow = lfilter([1.0 - keep], [1.0, -keep], given - given[0], axis=0) + given[0]
    return np.column_stack([np.interp(t_s, grid_s, column) for column in slow.T])


def _solved(rows: list[Array], right: list[Array]) -> tuple[float, Array]:
    A, b = np.vstack(rows), np.concatenate(right)
    found = np.linalg.lstsq(A, b, rcond=None)[0]
    return float(np.mean((b - A @ found) ** 2) / max(float(np.var(b)), 1e-12)), np.asarray(found, np.float64)


def _tilting(tracks: list[_Motion], sticks: Sticks) -> Iterator[tuple[float, dict[str, float]]]:
    """Yield what each lag and delay leaves of roll, pitch and yaw accelerations, and their parameters."""
    for lag_s, delay_s in itertools.product(LAGS_S, DELAYS_S):
        slow = [_followed(sticks, motion.inner_s, lag_s, delay_s) for motion in tracks]
        quick = [_followed(sticks, motion.inner_s, 1e-3, delay_s) for motion in tracks]
        sums, values = 0.0, {"rotor_lag": lag_s, "delay": delay_s}
        for axis, name, tilt, sign in ((0, "roll", 1, -1.0), (1, "pitch", 0, 1.0)):
            rows = [
                np.column_stack((u[:, axis], sign * m.up_inB[:, tilt], -m.rates[:, axis], np.ones(len(u))))
                for u, m in zip(slow, tracks, strict=True)
            ]
            left, (gain, stiffness, damping, rest) = _solved(rows, [m.turning[:, axis] for m in tracks])
            sums += left
            values |= {f"{name}_gain": gain, f"{name}_stiffness": stiffness, f"{name}_damping": damping}
            values[f"{name}_trim"] = rest / gain if gain else 0.0
        rows = [np.column_stack((u[:, 2], -m.rates[:, 2], np.ones(len(u)))) for u, m in zip(quick, tracks, strict=True)]
        left, (gain, damping, rest) = _solved(rows, [m.turning[:, 2] for m in tracks])
        values |= {"yaw_gain": gain, "yaw_damping": damping, "yaw_trim": rest / gain if gain else 0.0}
        yield sums + left, values


def _heaving(tracks: list[_Motion], sticks: Sticks, delay_s: float) -> Iterator[tuple[float, dict[str, float]]]:
    """Yield what each lag leaves of the climbing acceleration, and its parameters."""
    for lag_s in LAGS_S:
        slow = [_followed(sticks, motion.inner_s, lag_s, delay_s) for motion in tracks]
        rows = [
            np.column_stack((u[:, 3], -m.velocity[:, 2], np.ones(len(u)))) for u, m in zip(slow, tracks, strict=True)
        ]
        left, (gain, damping, rest) = _solved(rows, [m.acceleration[:, 2] for m in tracks])
        trim = rest / gain if gain else 0.0
        yield left, {"lift_lag": lag_s, "heave_gain": gain, "heave_damping": damping, "heave_trim": trim}
