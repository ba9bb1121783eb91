"""A ball hidden in every camera for a second and a half: what is sent stays within 5 sigma, and the track holds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2, norm

from tests.tracker.filter.test_ekf_consistency import Row, flown, wandering
from tracker.filter.sag import sag_covariance
from tracker.sources.paths import PathFunction
from tracker.sources.random_flight import random_flight

FIRST_S, LAST_S = 1.5, 3.0
LIMIT = float(chi2.isf(2.0 * norm.sf(5.0), 6))
PATHS: list[PathFunction] = [*(wandering(seed) for seed in range(6)), *(random_flight(seed) for seed in range(6))]


def hidden(ball: int, path: PathFunction, seed: int) -> list[Row]:
    return flown(path, seed, 4.0, hidden=lambda _, t_s: (ball,) if FIRST_S < t_s < LAST_S else ())


def distance2(row: Row) -> float:
    """Return the squared Mahalanobis distance of the pose's six errors, as an estimate reports them."""
    P = row.state.P[:6, :6].copy()
    P[:3, :3] += sag_covariance(row.state)
    return float(row.error[:6] @ np.linalg.solve(P, row.error[:6]))


@pytest.mark.parametrize("ball", range(3))
def test_a_hidden_ball_costs_what_the_covariance_says(ball: int) -> None:
    """Twelve flights that no filter chose; the mean is that of six degrees of freedom."""
    distances = []
    for seed, path in enumerate(PATHS):
        rows = hidden(ball, path, seed)
        assert len(rows) == 60
        distances += [distance2(row) for row in rows if row.t_s > FIRST_S]
    assert max(distances) < LIMIT
    assert np.mean(distances) < 8.0


@pytest.mark.parametrize("ball", range(3))
def test_the_balls_return_ends_it_at_once(ball: int) -> None:
    for seed, path in enumerate(PATHS):
        after = [row for row in hidden(ball, path, seed) if row.t_s > LAST_S + 0.05]
        assert max(float(np.linalg.norm(row.error[:3])) for row in after) < 0.001
        assert max(float(np.linalg.norm(row.error[3:6])) for row in after) < np.radians(1.0)
