"""A round whose images contradict each other makes a pose less sure than its filter has it."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tracker.rigs import PROCESS, ring_rig, sightings, state
from tracker.filter.ekf import Update, update
from tracker.filter.posterior import FREEDOM, spread
from tracker.filter.predict import predict
from tracker.filter.reported import reported
from tracker.state import ATTITUDE
from tracker.types import Array, frozen_array

SIGHTINGS, ROUNDS = 6, 400
RIG = ring_rig(2)
LATER_NS = 66_666_667
NOTHING_PX = np.zeros(2)


def model(rng: np.random.Generator) -> tuple[Array, Array]:
    """Draw R and S (12, 12) of a round: the pose behind it is hardly known before."""
    H = rng.normal(size=(2 * SIGHTINGS, 6))
    R = np.diag(rng.uniform(0.5, 2.0, 2 * SIGHTINGS))
    return R, R + 100.0 * H @ H.T


def spreads(noise: float) -> Array:
    """Return the spread of rounds whose noise is so many times its sigma, before the least of 1."""
    rng = np.random.default_rng(1)
    found = []
    for _ in range(ROUNDS):
        R, S = model(rng)
        inverse = np.ascontiguousarray(np.linalg.inv(S))
        y = rng.multivariate_normal(np.zeros(len(S)), S - R) + noise * rng.multivariate_normal(np.zeros(len(S)), R)
        found.append(spread(R, inverse @ y, inverse))
    return np.array(found)


def test_images_that_agree_make_no_pose_surer() -> None:
    R, S = model(np.random.default_rng(1))
    assert spread(R, np.zeros(len(S)), np.ascontiguousarray(np.linalg.inv(S))) == 1.0


def test_it_is_that_of_students_t() -> None:
    """What is left of innovations is chi-square with one degree of freedom for each figure too many, six here."""
    left = 9.0 * 6.0
    found = spreads(3.0)
    sigma = np.sqrt(2.0 * 6.0) * 9.0 / (FREEDOM + 6.0) / np.sqrt(ROUNDS)
    assert found.mean() == pytest.approx((FREEDOM + left) / (FREEDOM + 6.0), abs=4.0 * sigma)


def test_honest_noise_hardly_changes_it() -> None:
    assert 1.0 <= spreads(1.0).mean() < 1.1


def test_a_round_that_errs_more_than_its_fits_say_reports_it() -> None:
    flying = state(0, (0.2, -0.1, 0.1), (12.0, -8.0, 130.0))
    exact = sightings(flying, RIG, [(camera, LATER_NS) for camera in (0, 1)], 0.1)
    rng = np.random.default_rng(3)
    spoilt = tuple(one._replace(uv_px=frozen_array(one.uv_px + rng.normal(0.0, 0.2, 2))) for one in exact)
    calm, wild = (update(predict(flying, LATER_NS, PROCESS), seen, RIG, 0.999) for seen in (exact, spoilt))
    assert isinstance(calm, Update)
    assert isinstance(wild, Update)
    assert (calm.spread, wild.spread > 1.2) == (1.0, True)
    for one in (calm, wild):
        covariance, _ = reported(one.state, one.spread, RIG, 0.0, NOTHING_PX, NOTHING_PX)
        assert covariance[ATTITUDE, ATTITUDE] == pytest.approx(one.spread * one.state.P[ATTITUDE, ATTITUDE])
