"""The filter's own figures of its errors, on measurements of its own model: chi-square, as they say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from tests.tracker.rigs import PROCESS, at, covariance, difference, perturbed, ring_rig, sightings, state
from tracker.ekf import Update, predict, update
from tracker.state import State, process_noise
from tracker.types import Array

RIG = ring_rig(2)
SIGMA_PX = 0.1
PERIOD_NS = 33_333_333
OPEN = 1.0 - 1e-9  # a gate that lets every true sighting pass
FLYING = state(0, (0.2, -0.1, 0.1), (12.0, -8.0, 130.0), (1.0, -0.5, 0.3), (0.4, -0.8, 1.5))
SURE = 1e-6  # chance of a false alarm of each band below, seeded all the same


def band(dof: int) -> tuple[float, float]:
    """Return where a chi-square sum must lie."""
    return float(chi2.ppf(SURE / 2, dof)), float(chi2.ppf(1 - SURE / 2, dof))


def drawn(rng: np.random.Generator, P: Array) -> Array:
    return np.asarray(np.linalg.cholesky(P) @ rng.normal(size=12))


def nees(truth: State, found: State) -> float:
    error = difference(truth, found)
    return float(error @ np.linalg.solve(found.P, error))


def views_of(k: int, t_ns: int) -> list[tuple[int, int]]:
    """Return which cameras see at step k: both at once, then only one, then half a frame apart."""
    return [(0, t_ns), (1, t_ns)] if k < 6 else [(0, t_ns)] if k < 9 else [(0, t_ns - PERIOD_NS // 2), (1, t_ns)]


@pytest.fixture(scope="module")
def flights() -> tuple[Array, Array, Array]:
    """Fly 25 vehicles that do what the process says, on measurements of the filter's own model.

    One ball is hidden at step 3 and from one camera until 5, one camera is blind for 6 to 8, and from 9 on the
    cameras run free.

    Returns:
        NEES (25, 12), NIS (25, 12) and the degrees of freedom of the latter, after each step.
    """
    rng = np.random.default_rng(11)
    shape = (25, 12)
    errors, innovations, freedom = np.empty(shape), np.empty(shape), np.empty(shape)
    prior = covariance(0.01, 0.05, 0.5, 0.5)
    for run in range(shape[0]):
        truth = replace(FLYING, P=prior)
        guess = perturbed(truth, drawn(rng, prior))
        for k in range(shape[1]):
            t_ns = (k + 1) * PERIOD_NS
            truth = perturbed(at(truth, t_ns), drawn(rng, process_noise(PROCESS, PERIOD_NS * 1e-9)))
            seen = sightings(truth, RIG, views_of(k, t_ns), SIGMA_PX, rng)
            seen = tuple(s for s in seen if not (s.ball == 1 and (k == 3 or (s.camera == 0 and k in (4, 5)))))
            found = update(predict(guess, t_ns, PROCESS), seen, RIG, OPEN)
            assert isinstance(found, Update), found
            guess = found.state
            errors[run, k], innovations[run, k], freedom[run, k] = nees(truth, guess), found.nis, found.dof
    return errors, innovations, freedom


def test_errors_are_as_large_as_the_covariance_says_at_every_step(flights: tuple[Array, Array, Array]) -> None:
    """NEES over independent flights is chi-square, with a ball hidden, a camera blind, cameras running free."""
    errors = flights[0]
    low, high = band(12 * len(errors))
    sums = errors.sum(axis=0)
    assert low < sums.min()
    assert sums.max() < high


def test_innovations_are_as_large_as_the_filter_expects(flights: tuple[Array, Array, Array]) -> None:
    _, innovations, freedom = flights
    assert set(freedom[0].tolist()) == {12.0, 10.0, 8.0, 6.0}
    low, high = band(int(freedom.sum()))
    assert low < innovations.sum() < high
