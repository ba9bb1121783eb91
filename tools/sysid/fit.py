"""Output error: the parameters with which the model's run through a flight comes nearest to what was seen.

Source: Jategaonkar, "Flight vehicle system identification", 2nd ed. 2015, ch. 4; Maine and Iliff, NASA RP-1138 (1985).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from tools.sysid import noise, parameters
from tools.sysid.flight_data import FlightData
from tools.sysid.noise import Noise
from tools.sysid.response import START_SIGMA, Unknowns, all_residuals, first_states, measured_sigma
from tracker.types import Array

ROUNDS = 3
"""Fits, each with the noise that the one before it left over."""

_STEP = 1e-4
_START_SCALE = np.repeat([0.3, 0.05, 0.5, 0.2, 1.0], [3, 3, 3, 2, 1])


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """What a fit came to.

    jacobian: of the whitened residuals of each track (m, channels, unknowns).  left: these residuals (m, channels).
    """

    unknowns: Unknowns
    noise: Noise
    left: tuple[Array, ...]
    jacobian: tuple[Array, ...]


def fit(theta: Array, data: FlightData, model: Noise | None = None) -> Fit:
    """Fit the parameters, starting from theta, and each track's first state.

    model: the noise of a fit to part of the data, to start from; None for what the log's covariances say.
    """
    unknowns = Unknowns(np.clip(theta, parameters.LEAST, parameters.MOST), first_states(data))
    rounds = ROUNDS if model is None else 1
    if model is None:
        sigma = np.median(np.vstack([measured_sigma(track) for track in data.tracks]), axis=0)
        model = noise.white(sigma)
    for _ in range(rounds):
        unknowns = _minimised(unknowns, data, model)
        model = noise.fitted(all_residuals(unknowns, data))
    unknowns = _minimised(unknowns, data, model)
    left = tuple(model.whitened(rows) for rows in all_residuals(unknowns, data))
    return Fit(unknowns, model, left, _derivatives(unknowns, data, model))


def fit_starts(theta: Array, data: FlightData, model: Noise) -> Unknowns:
    """Find the first states alone, with parameters that stay: for tracks that the fit has not seen."""
    unknowns = Unknowns(theta, first_states(data))
    return _minimised(unknowns, data, model, free=parameters.COUNT)


def _minimised(unknowns: Unknowns, data: FlightData, model: Noise, free: int = 0) -> Unknowns:
    """Return the unknowns of least squares; the first `free` ones stay as they are."""
    flat = unknowns.flat()
    guess = first_states(data)
    start_sigma = np.tile(START_SIGMA, len(data.tracks))
    kept = flat[:free]

    def against(values: Array) -> Array:
        found = Unknowns.of(np.concatenate((kept, values)))
        rows = [model.whitened(each).ravel() for each in all_residuals(found, data)]
        return np.concatenate((*rows, (found.starts - guess).ravel() / start_sigma))

    def derivatives(values: Array) -> Array:
        found = Unknowns.of(np.concatenate((kept, values)))
        blocks = [each.reshape(-1, len(flat))[:, free:] for each in _derivatives(found, data, model)]
        prior = np.zeros((len(start_sigma), len(values)))
        prior[:, -len(start_sigma) :] = np.diag(1.0 / start_sigma)
        return np.vstack((*blocks, prior))

    unbounded = np.full(len(start_sigma), np.inf)
    bounds = (np.concatenate((parameters.LEAST, -unbounded)), np.concatenate((parameters.MOST, unbounded)))
    scale = np.concatenate((parameters.SCALE, np.tile(_START_SCALE, len(data.tracks))))
    found = least_squares(
        against,
        flat[free:],
        derivatives,
        bounds=(bounds[0][free:], bounds[1][free:]),
        x_scale=scale[free:],
        ftol=1e-6,
        xtol=1e-7,
        max_nfev=40,
    )
    return Unknowns.of(np.concatenate((kept, found.x)))


def _derivatives(unknowns: Unknowns, data: FlightData, model: Noise) -> tuple[Array, ...]:
    """Return the whitened residuals' derivatives of each track (m, channels, unknowns), by central differences."""
    flat = unknowns.flat()
    count = parameters.COUNT
    result = []
    for number, track in enumerate(data.tracks):
        alone = FlightData((track,), data.sticks)
        own = slice(count + number * len(START_SIGMA), count + (number + 1) * len(START_SIGMA))
        local = np.concatenate((flat[:count], flat[own]))
        steps = _STEP * np.concatenate((parameters.SCALE, _START_SCALE))
        columns = []
        for k, step in enumerate(steps):
            up, down = local.copy(), local.copy()
            up[k] += step
            down[k] -= step
            (high,), (low,) = (all_residuals(Unknowns.of(each), alone) for each in (up, down))
            columns.append((high - low) / (2.0 * step))
        whitened = model.whitened(np.stack(columns, axis=-1))
        full = np.zeros((*whitened.shape[:2], len(flat)))
        full[:, :, :count], full[:, :, own] = whitened[:, :, :count], whitened[:, :, count:]
        result.append(full)
    return tuple(result)
