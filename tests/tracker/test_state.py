"""How the state goes on in time, and how sure it stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from tests.tracker.rigs import PROCESS, SECOND_NS, difference, perturbed, state
from tracker.filter.predict import predict
from tracker.filter.singer import carried, process_noise
from tracker.state import State
from tracker.types import Array

VECTOR = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)).map(np.array)
SECONDS = st.floats(0.001, 0.3)
T = PROCESS.manoeuvre_s


def error_of(truth: State, guess: State) -> Array:
    """Return the whole error (19,) between two states."""
    return np.concatenate(
        (
            difference(truth, guess), truth.a_BinW - guess.a_BinW, truth.alpha_BinB - guess.alpha_BinB,
            truth.offsets_s[1:] - guess.offsets_s[1:],
        )
    )  # fmt: skip


@given(VECTOR, VECTOR, VECTOR, VECTOR, VECTOR, SECONDS)
def test_the_transition_is_that_of_finite_differences(
    euler: Array, v: Array, w: Array, a: Array, alpha: Array, dt: float
) -> None:
    step = 1e-5
    start = replace(state(0, euler_deg=30.0 * euler, v_BinW=v, w_BinB=2.0 * w), a_BinW=3.0 * a, alpha_BinB=5.0 * alpha)

    def then(error: Array) -> State:
        return start.with_mean(carried(start.moved(error).mean, dt, T, 19)[0])

    columns = [error_of(then(step * e), then(-step * e)) / (2.0 * step) for e in np.eye(19)]
    assert np.allclose(carried(start.mean, dt, T, 19)[1], np.column_stack(columns), atol=1e-6)


@given(SECONDS, SECONDS)
def test_noise_adds_up_however_the_time_is_split(first: float, second: float) -> None:
    """Exact at rate zero: two frames of free-running cameras add what one long step adds."""
    F = carried(state().mean, second, T, 19)[1]
    split = F @ process_noise(19, first, T, 4.0, 9.0) @ F.T + process_noise(19, second, T, 4.0, 9.0)
    whole = process_noise(19, first + second, T, 4.0, 9.0)
    scale = np.sqrt(np.diag(whole)) + 1e-30
    assert np.allclose(split / np.outer(scale, scale), whole / np.outer(scale, scale), atol=0.03)


@pytest.mark.parametrize("dt", [0.0039, 0.0041, 0.033, 0.2, 1.0])
def test_noise_is_that_of_the_differential_equation(dt: float) -> None:
    """Van Loan, "Computing integrals involving the matrix exponential", 1978, by scipy."""
    A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0 / T]])
    G = np.zeros((3, 3))
    G[2, 2] = 2.0 / T
    big = expm(np.block([[-A, G], [np.zeros((3, 3)), A.T]]) * dt)
    expected = big[3:, 3:].T @ big[:3, 3:]
    Q = process_noise(19, dt, T, 1.0, 0.0)[np.ix_([1, 7, 13], [1, 7, 13])]
    assert np.allclose(Q / expected, 1.0, atol=0.02)


def test_a_prediction_carries_the_state_and_grows_its_covariance() -> None:
    start = replace(state(0, v_BinW=(1.0, 0.0, 0.0)), a_BinW=np.array([0.0, 2.0, 0.0]))
    ahead = predict(start, SECOND_NS // 10, PROCESS).state
    assert ahead.p_BinW[0] == pytest.approx(0.1)
    assert 0.8 * 0.01 < ahead.p_BinW[1] < 0.01
    assert np.linalg.eigvalsh(ahead.P - predict(start, SECOND_NS // 10, PROCESS).P_coasted).min() > -1e-12


@given(VECTOR, VECTOR, VECTOR)
def test_an_error_put_in_is_the_one_that_is_found(theta: Array, v: Array, w: Array) -> None:
    start = state(0, euler_deg=(10.0, -20.0, 130.0))
    dx = np.concatenate((v, 0.5 * theta, w, v - w, v, w, [0.01]))
    assert np.allclose(error_of(start.moved(dx), start), dx, atol=1e-9)
    assert np.allclose(difference(perturbed(start, dx), start.moved(dx)), 0.0, atol=1e-9)


def test_the_vector_of_a_state_shows_a_part_that_was_replaced() -> None:
    carried_on = predict(state(0, v_BinW=np.array([1.0, 2.0, 3.0])), SECOND_NS // 10, PROCESS).state
    turned_back = replace(carried_on, v_BinW=-carried_on.v_BinW)
    assert carried_on.mean[12:15].tolist() == carried_on.v_BinW.tolist()
    assert turned_back.mean[12:15].tolist() == (-carried_on.v_BinW).tolist()
    assert turned_back.mean[:12].tolist() == carried_on.mean[:12].tolist()
