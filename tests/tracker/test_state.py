"""How the state goes on in time, and how sure it stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad_vec
from scipy.linalg import expm

from tests.tracker.rigs import PROCESS, SECOND_NS, difference, perturbed, state
from tracker.filter.matern import carried, process_noise
from tracker.filter.predict import predict
from tracker.state import State
from tracker.types import Array

VECTOR = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)).map(np.array)
SECONDS = st.floats(0.001, 0.3)
T = PROCESS.manoeuvre_s


def error_of(truth: State, guess: State) -> Array:
    """Return the whole error (25,) between two states."""
    return np.concatenate(
        (
            difference(truth, guess), truth.a_BinW - guess.a_BinW, truth.alpha_BinB - guess.alpha_BinB,
            truth.j_BinW - guess.j_BinW, truth.beta_BinB - guess.beta_BinB,
            truth.offsets_s[1:] - guess.offsets_s[1:],
        )
    )  # fmt: skip


@given(VECTOR, VECTOR, VECTOR, VECTOR, VECTOR, SECONDS)
def test_the_transition_is_that_of_finite_differences(
    euler: Array, v: Array, w: Array, a: Array, alpha: Array, dt: float
) -> None:
    step = 1e-5
    start = state(0, euler_deg=30.0 * euler, v_BinW=v, w_BinB=2.0 * w)
    start = start.with_parts(a_BinW=3.0 * a, alpha_BinB=5.0 * alpha, j_BinW=9.0 * v, beta_BinB=20.0 * w)

    def then(error: Array) -> State:
        return replace(start, mean=carried(start.moved(error).mean, dt, T, 25)[0])

    columns = [error_of(then(step * e), then(-step * e)) / (2.0 * step) for e in np.eye(25)]
    assert np.allclose(carried(start.mean, dt, T, 25)[1], np.column_stack(columns), atol=1e-6)


@given(SECONDS, SECONDS)
def test_noise_adds_up_however_the_time_is_split(first: float, second: float) -> None:
    """Exact at rate zero: two frames of free-running cameras add what one long step adds."""
    F = carried(state().mean, second, T, 25)[1]
    strengths = np.arange(1.0, 5.0)
    split = F @ process_noise(25, first, T, strengths) @ F.T + process_noise(25, second, T, strengths)
    whole = process_noise(25, first + second, T, strengths)
    scale = np.sqrt(np.diag(whole)) + 1e-30
    assert np.allclose(split / np.outer(scale, scale), whole / np.outer(scale, scale), atol=1e-6)


@pytest.mark.parametrize(("smooth", "sudden"), [(1.0, 0.0), (0.0, 1.0), (2.0, 3.0)])
@pytest.mark.parametrize("dt", [1e-4, 0.033, 0.2, 1.0])
def test_noise_is_that_of_the_differential_equation(dt: float, smooth: float, sudden: float) -> None:
    """Of (1) in `matern`, by scipy's exponential and quadrature."""
    rate = 2.0 / T
    A = np.diag([1.0, 1.0, 1.0], 1)
    A[3, 2:] = -(rate**2), -2.0 * rate
    G = np.diag([0.0, 0.0, sudden, 4.0 * rate**3 * smooth])
    expected, _ = quad_vec(lambda t: expm(A * t) @ G @ expm(A * t).T, 0.0, dt, epsabs=0.0)
    Q = process_noise(25, dt, T, np.array([smooth, 0.0, sudden, 0.0]))[np.ix_([1, 7, 13, 19], [1, 7, 13, 19])]
    assert np.allclose(Q / expected, 1.0, atol=1e-5)


def test_a_smooth_acceleration_is_as_strong_after_a_while_as_it_was() -> None:
    """Variance 1 of acceleration, (2 / T)^2 of its jerk: the process is stationary."""
    start = np.diag([1.0, (2.0 / T) ** 2])
    F = carried(state().mean, 0.1, T, 25)[1][np.ix_([12, 18], [12, 18])]
    Q = process_noise(25, 0.1, T, np.array([1.0, 0.0, 0.0, 0.0]))[np.ix_([12, 18], [12, 18])]
    assert np.allclose(F @ start @ F.T + Q, start)


def test_a_prediction_carries_the_state_and_grows_its_covariance() -> None:
    start = state(0, v_BinW=(1.0, 0.0, 0.0)).with_parts(a_BinW=np.array([0.0, 2.0, 0.0]))
    ahead = predict(start, SECOND_NS // 10, PROCESS).state
    assert ahead.p_BinW[0] == pytest.approx(0.1)
    assert 0.8 * 0.01 < ahead.p_BinW[1] < 0.01
    assert np.linalg.eigvalsh(ahead.P - predict(start, SECOND_NS // 10, PROCESS).P_coasted).min() > -1e-12


@given(VECTOR, VECTOR, VECTOR)
def test_an_error_put_in_is_the_one_that_is_found(theta: Array, v: Array, w: Array) -> None:
    start = state(0, euler_deg=(10.0, -20.0, 130.0))
    dx = np.concatenate((v, 0.5 * theta, w, v - w, v, w, v + w, theta, [0.01]))
    assert np.allclose(error_of(start.moved(dx), start), dx, atol=1e-9)
    assert np.allclose(difference(perturbed(start, dx), start.moved(dx)), 0.0, atol=1e-9)


def test_the_vector_of_a_state_shows_a_part_that_was_replaced() -> None:
    carried_on = predict(state(0, v_BinW=np.array([1.0, 2.0, 3.0])), SECOND_NS // 10, PROCESS).state
    turned_back = carried_on.with_parts(v_BinW=-carried_on.v_BinW)
    assert carried_on.mean[12:15].tolist() == carried_on.v_BinW.tolist()
    assert turned_back.mean[12:15].tolist() == (-carried_on.v_BinW).tolist()
    assert turned_back.mean[:12].tolist() == carried_on.mean[:12].tolist()
