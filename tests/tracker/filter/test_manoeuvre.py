"""How brisk the manoeuvre is: what time and pixels do to the levels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from tests.tracker.rigs import PROCESS, ring_rig, sightings, state
from tracker.filter.batch import make_batch, sighted
from tracker.filter.manoeuvre import (
    AXES,
    LEVELS,
    RARER,
    as_gained,
    expected,
    later,
    log_likelihoods,
    start_levels,
    strengths,
)
from tracker.filter.matern import KINDS, MOTIONS, process_noise, unit_noise
from tracker.filter.measure import predicted_pixels
from tracker.filter.predict import predict
from tracker.types import Array

OF = strengths(PROCESS)


@given(st.integers(0, LEVELS - 1), st.floats(0.001, 10.0))
def test_a_change_of_level_is_rarer_the_further_it_goes(level: int, dt: float) -> None:
    levels = np.zeros((MOTIONS, LEVELS))
    levels[:, level] = 1.0
    after = later(levels, dt)
    assert np.allclose(after.sum(axis=1), 1.0)
    for way in (after[:, level + 1 :], after[:, :level][:, ::-1]):
        assert np.allclose(way[:, 1:], RARER * way[:, :-1])


def test_the_likelihood_of_a_level_is_that_of_its_gaussian() -> None:
    """By scipy, with one motion at each level and the other at its mean."""
    rng = np.random.default_rng(1)
    A, *B = (root @ root.T for root in rng.normal(size=(5, 6, 6)))
    y, means = rng.normal(size=6), expected(start_levels(), OF)
    found = log_likelihoods(y, A, np.array(B), OF, means)
    for motion in range(MOTIONS):
        tried = np.tile(means, (LEVELS, 1))
        tried[:, motion::MOTIONS] = OF[motion::MOTIONS].T
        sums = [A + np.tensordot(strength, B, 1) for strength in tried]
        true = np.array([multivariate_normal.logpdf(y, cov=S) for S in sums])
        assert np.allclose(found[motion] - found[motion, 0], true - true[0])


@pytest.mark.parametrize("strength", range(4))
def test_each_strength_adds_its_process_noise_to_the_innovation(strength: int) -> None:
    rig, t_ns = ring_rig(2), 33_000_000
    now = state(0, (0.2, -0.1, 0.1), (12.0, -8.0, 130.0), (1.0, -0.5, 0.3), (0.4, -0.8, 1.5))
    ahead = predict(now, t_ns, PROCESS)
    seen = sightings(now, rig, [(0, t_ns), (1, t_ns + 5_000_000)], 0.1)
    batch = make_batch(ahead, sighted(seen, t_ns), rig)
    H = np.concatenate([predicted_pixels(ahead.state, rig, s.camera, s.t_ns)[1][s.ball] for s in seen])
    Q = process_noise(25, ahead.dt, PROCESS.manoeuvre_s, np.eye(4)[strength])
    assert np.allclose(batch.B[strength] - batch.path[strength], H @ Q @ H.T)


T, DT = PROCESS.manoeuvre_s, 0.067
UNIT = unit_noise(DT, T)[:, 0, 0]
NOTHING = np.zeros((KINDS * MOTIONS, 6, 6))  # of one motion in the other's pixels


def shown(seed: int) -> tuple[Array, Array]:
    """Return H (6, 25) and A (6, 6) of pixels each of which shows one axis of a motion, all of one as well."""
    rng = np.random.default_rng(seed)
    H = np.zeros((6, 25))
    H[:, :6] = np.diag(np.repeat(rng.uniform(10.0, 1000.0, MOTIONS), AXES))
    return H, np.eye(6) * rng.uniform(0.5, 2.0)


def gain(A: Array, H: Array, strengths: Array, motion: int) -> float:
    """Return the share of an innovation along one of a motion's axes that an update takes for the manoeuvre's."""
    axis = AXES * motion
    raised = H[axis, axis] ** 2 * (strengths[motion::MOTIONS] @ UNIT)
    return float(raised / (A[axis, axis] + raised))


def some_levels(seed: int) -> Array:
    return np.random.default_rng(seed).dirichlet(np.full(LEVELS, 0.5), MOTIONS)


@pytest.mark.parametrize("seed", range(5))
def test_one_update_gains_what_the_levels_own_updates_gain_in_the_mean(seed: int) -> None:
    (H, A), levels = shown(seed), some_levels(seed)
    one = as_gained(levels, OF, H, A, NOTHING, DT, T)
    for motion in range(MOTIONS):
        each = [gain(A, H, OF[:, level], motion) for level in range(LEVELS)]
        assert gain(A, H, one, motion) == pytest.approx(levels[motion] @ each)
    assert (one < expected(levels, OF)).all()


@pytest.mark.parametrize("axis", range(AXES))
def test_where_an_axis_is_not_seen_the_mean_strength_stands(axis: int) -> None:
    """It alone says how far the vehicle may have gone there."""
    (H, A), levels = shown(1), some_levels(1)
    H[:, [axis, AXES + axis]] = 0.0
    assert np.allclose(as_gained(levels, OF, H, A, NOTHING, DT, T), expected(levels, OF))


@pytest.mark.parametrize("level", range(LEVELS))
def test_a_level_that_is_certain_keeps_its_strength(level: int) -> None:
    levels = np.zeros((MOTIONS, LEVELS))
    levels[:, level] = 1.0
    assert np.allclose(as_gained(levels, OF, *shown(level), NOTHING, DT, T), OF[:, level])


def test_without_time_for_a_manoeuvre_the_mean_strength_stands() -> None:
    assert np.array_equal(as_gained(start_levels(), OF, *shown(1), NOTHING, 0.0, T), expected(start_levels(), OF))


@pytest.mark.parametrize("seed", range(3))
def test_pixels_that_show_all_leave_a_strength_that_is_a_number(seed: int) -> None:
    """Nothing is left to weigh but the levels: one over the strength is the mean of one over theirs."""
    (H, A), levels = shown(seed), some_levels(seed)
    one = as_gained(levels, OF, H, 1e-40 * A, NOTHING, DT, T)
    for motion in range(MOTIONS):
        each = OF[motion::MOTIONS].T @ UNIT
        assert one[motion::MOTIONS] @ UNIT == pytest.approx(1.0 / (levels[motion] @ (1.0 / each)))
