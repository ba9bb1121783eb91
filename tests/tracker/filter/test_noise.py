"""What a camera adds to its fits is learned: what moves each ball apart, and what moves all of its balls alike."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tracker.filter.test_ekf_consistency import FIT_PX, SIGMA_PX, flown
from tracker.filter.noise import ALIKE, APART, APART_KNOWN, learned, start_noise
from tracker.sources.paths import PATHS
from tracker.types import Array

CAMERAS = np.array([0, 0, 0, 1, 1])
OWN_PX = np.sqrt(SIGMA_PX**2 - FIT_PX**2)
SHAKE_PX, LEARNED_S = 0.3, 2.0


def adding(kind: int, camera: int) -> Array:
    """Return what a variance of 1 adds to the covariance (10, 10) of the sightings of CAMERAS."""
    sees = np.diag(np.equal(CAMERAS, camera).astype(float))
    return np.asarray(np.kron(sees if kind == APART else sees @ np.ones((5, 5)) @ sees, np.eye(2)))


def log_likelihood(y: Array, S: Array) -> float:
    return float(-0.5 * (np.linalg.slogdet(S)[1] + y @ np.linalg.solve(S, y)))


@pytest.mark.parametrize("camera", [0, 1])
@pytest.mark.parametrize("kind", [APART, ALIKE])
def test_a_variance_goes_where_the_likelihood_grows(kind: int, camera: int) -> None:
    rng = np.random.default_rng(kind + camera)
    root = rng.normal(size=(10, 10))
    S, y, before = root @ root.T + np.eye(10), rng.normal(size=10), start_noise(2, 1.0)
    before[:, ALIKE] = 0.5
    inverse: Array = np.asarray(np.linalg.inv(S), np.float64)
    after = learned(before, CAMERAS, inverse @ y, inverse)
    score = (after - before)[camera, kind] * after[camera, kind + APART_KNOWN]
    step = 1e-5 * adding(kind, camera)
    assert score == pytest.approx((log_likelihood(y, S + step) - log_likelihood(y, S - step)) / 2e-5, rel=1e-5)


def test_one_ball_tells_nothing_of_what_all_share() -> None:
    before, inverse = start_noise(2, 0.1), 100.0 * np.eye(4)
    after = learned(before, np.array([0, 1]), np.full(4, 10.0), inverse)
    assert np.array_equal(after[:, ALIKE:], before[:, ALIKE:])


def test_what_moves_balls_apart_is_learned_and_no_shake_feigned() -> None:
    noise = flown(PATHS["figure8"], 2, 20.0)[-1].state.noise
    assert np.sqrt(noise[:, APART]) == pytest.approx(OWN_PX, rel=0.15)
    assert np.sqrt(noise[:, ALIKE]).max() < OWN_PX / 2.0


@pytest.mark.parametrize("shakes_px", [(SHAKE_PX, 0.0), (0.0, SHAKE_PX), (SHAKE_PX, SHAKE_PX)])
@pytest.mark.parametrize("name", ["hover", "figure8"])
def test_a_camera_that_shakes_is_told_from_balls_that_err_apart(name: str, shakes_px: tuple[float, float]) -> None:
    """Which of two cameras shakes may not be told, but together they are as unsure as they should be."""
    rows = flown(PATHS[name], 3, 20.0, shakes_px=shakes_px, clock_s=1e-4)
    noise = rows[-1].state.noise
    assert len(rows) == 300
    assert np.mean([row.pose2 for row in rows if row.t_s > LEARNED_S]) < 10.0  # of six degrees of freedom
    assert noise[:, ALIKE].sum() == pytest.approx(np.square(shakes_px).sum(), rel=0.4)
    assert np.sqrt(noise[:, APART]) == pytest.approx(OWN_PX, rel=0.2)
