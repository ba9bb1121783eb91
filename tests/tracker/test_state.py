"""How the state goes on in time, and how sure it stays."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tracker.rigs import PROCESS, SECOND_NS, at, difference, perturbed, state
from tracker.state import ATTITUDE, POSITION, RATE, VELOCITY, coasted, process_noise, transition
from tracker.types import Array

VECTOR = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)).map(np.array)
SECONDS = st.floats(0.001, 0.3)


@given(VECTOR, VECTOR, VECTOR, SECONDS)
def test_the_transition_is_that_of_finite_differences(euler: Array, v: Array, w: Array, dt: float) -> None:
    step, t_ns = 1e-5, round(dt * SECOND_NS)
    start = state(0, euler_deg=30.0 * euler, v_BinW=v, w_BinB=2.0 * w)
    measured = np.column_stack(
        [
            difference(at(perturbed(start, step * e), t_ns), at(perturbed(start, -step * e), t_ns)) / (2.0 * step)
            for e in np.eye(12)
        ]
    )
    assert np.allclose(transition(start.w_BinB, t_ns * 1e-9), measured, atol=1e-7)


@given(VECTOR, VECTOR, VECTOR, st.integers(-(10**8), 10**9))
def test_a_vehicle_left_alone_keeps_velocity_and_rate(euler: Array, v: Array, w: Array, t_ns: int) -> None:
    start = state(10, (1.0, 2.0, 3.0), 30.0 * euler, v, w)
    error = difference(at(start, 10 + t_ns), coasted(start, 10 + t_ns))
    assert np.allclose(error, 0.0, atol=1e-9)
    assert np.allclose(difference(start, coasted(coasted(start, 10 + t_ns), 10)), 0.0, atol=1e-9)


@given(VECTOR, VECTOR, VECTOR)
def test_an_error_put_in_is_the_one_that_is_found(theta: Array, v: Array, w: Array) -> None:
    start = state(0, euler_deg=(10.0, -20.0, 130.0))
    dx = np.concatenate((v, 0.5 * theta, w, v - w))
    assert np.allclose(difference(start.moved(dx), start), dx, atol=1e-9)


@given(SECONDS, SECONDS)
def test_noise_adds_up_however_the_time_is_split(first: float, second: float) -> None:
    """Exact at rate zero: two frames of free-running cameras add what one long step adds."""
    F = transition(np.zeros(3), second)
    split = F @ process_noise(PROCESS, first) @ F.T + process_noise(PROCESS, second)
    assert np.allclose(split, process_noise(PROCESS, first + second), rtol=1e-9, atol=1e-15)


@given(SECONDS)
def test_noise_is_a_covariance_of_speed_and_place_together(dt: float) -> None:
    Q = process_noise(PROCESS, dt)
    assert np.array_equal(Q, Q.T)
    assert np.linalg.eigvalsh(Q).min() > 0.0
    assert np.allclose(np.diag(Q)[VELOCITY], PROCESS.acceleration_m_s2**2 * PROCESS.manoeuvre_s * dt)
    assert np.allclose(np.diag(Q)[RATE], PROCESS.angular_acceleration_rad_s2**2 * PROCESS.manoeuvre_s * dt)
    assert not Q[POSITION, ATTITUDE].any()
    assert not Q[VELOCITY, RATE].any()


def test_no_time_brings_no_noise() -> None:
    assert not process_noise(PROCESS, 0.0).any()


def test_noise_is_that_of_an_acceleration_that_changes_at_random() -> None:
    """White acceleration in 200 small steps over 0.1 s, many times: the spread of speed and place is Q's."""
    rng = np.random.default_rng(5)
    runs, steps, dt = 4000, 200, 0.1 / 200
    q = PROCESS.acceleration_m_s2**2 * PROCESS.manoeuvre_s
    speed = np.cumsum(rng.normal(scale=np.sqrt(q * dt), size=(runs, steps)), axis=1)
    place = (speed - speed[:, :1] / 2).sum(axis=1) * dt
    sampled = np.cov(np.stack((place, speed[:, -1])))
    Q = process_noise(PROCESS, 0.1)
    expected = Q[np.ix_([0, 6], [0, 6])]
    # The sampled variance of n runs is off by sqrt(2 / n), 2.2 %; five of those.
    assert sampled == pytest.approx(expected, rel=5 * np.sqrt(2 / runs))
