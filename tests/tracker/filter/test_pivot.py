"""An open turn is told of the point it leaves alone, and what a tangent misses is in the covariance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.tracker.rigs import PROCESS, covariance, difference, ring_rig, sightings, state
from tracker.filter.batch import make_batch, sighted
from tracker.filter.correction import moved, moved_slope
from tracker.filter.pivot import best_known, moved_to
from tracker.filter.predict import Prediction, predict
from tracker.filter.sag import sag_covariance
from tracker.state import State
from tracker.types import Array

RIG = ring_rig(2)
POINT = np.array([0.03, -0.02, 0.04])
STEADY = state(0, (0.2, -0.1, 0.1), (12.0, -8.0, 130.0), (1.0, -0.5, 0.3), (0.4, -0.8, 1.5))
FLYING = STEADY.with_parts(
    a_BinW=np.array([3.0, -2.0, 1.0]),
    alpha_BinB=np.array([5.0, 4.0, -6.0]),
    j_BinW=np.array([20.0, 10.0, -30.0]),
    beta_BinB=np.array([-40.0, 30.0, 50.0]),
)


def body_line(hidden: int) -> tuple[Array, Array]:
    """Return the middle of the two balls that are seen and the unit vector from one to the other, in B."""
    a, b = np.delete(RIG.marker.points_inB, hidden, axis=0)
    return (a + b) / 2.0, (b - a) / np.linalg.norm(b - a)


def open_about(hidden: int, turn_rad: float) -> State:
    """Return a state of which two balls are known to a tenth of a millimetre, and the turn about them is open."""
    middle, axis = body_line(hidden)
    at_line, _ = moved_to(FLYING.mean, middle, 25)
    P = covariance(1e-4, 1e-3, 0.01, 0.01)
    P[3:6, 3:6] += turn_rad**2 * np.outer(axis, axis)
    _, back = moved_to(at_line, -middle, 25)
    return replace(FLYING, P=np.ascontiguousarray(back @ P @ back.T))


def test_a_point_and_back_is_the_origin_again() -> None:
    there, J = moved_to(FLYING.mean, POINT, 25)
    again, back = moved_to(there, -POINT, 25)
    assert np.allclose(again, FLYING.mean, atol=1e-12)
    assert np.allclose(back @ J, np.eye(25), atol=1e-12)


def test_the_point_moves_as_a_rigid_body_has_it() -> None:
    """Against a body that turns by its rate and the rate's derivatives, by central differences.

    A rotation vector phi turns it at rate phi' - phi x phi' / 2 + ..., hence the half.
    """
    third = FLYING.beta_BinB + np.cross(FLYING.w_BinB, FLYING.alpha_BinB) / 2.0

    def place(t_s: float) -> Array:
        phi = FLYING.w_BinB * t_s + FLYING.alpha_BinB * t_s**2 / 2.0 + third * t_s**3 / 6.0
        turn = Rotation.from_rotvec(phi).as_matrix()
        origin = FLYING.p_BinW + FLYING.v_BinW * t_s + FLYING.a_BinW * t_s**2 / 2.0 + FLYING.j_BinW * t_s**3 / 6.0
        return np.asarray(origin + FLYING.R_BtoW @ turn @ POINT)

    after, _ = moved_to(FLYING.mean, POINT, 25)
    h = 1e-4
    assert np.allclose(after[:3], place(0.0))
    assert np.allclose(after[12:15], (place(h) - place(-h)) / (2.0 * h), atol=1e-6)
    assert np.allclose(after[18:21], (place(h) - 2.0 * place(0.0) + place(-h)) / h**2, atol=1e-5)
    h = 1e-3
    jump = (place(2.0 * h) - place(-2.0 * h) - 2.0 * (place(h) - place(-h))) / (2.0 * h**3)
    assert np.allclose(after[24:27], jump, atol=1e-3)


def test_the_jacobian_agrees_with_finite_differences() -> None:
    after, J = moved_to(FLYING.mean, POINT, 25)
    for k in range(24):
        dx = np.zeros(25)
        dx[k] = 1e-6
        there, _ = moved_to(FLYING.moved(dx).mean, POINT, 25)
        for error, rows in (
            (slice(0, 3), slice(0, 3)),
            (slice(6, 9), slice(12, 15)),
            (slice(12, 15), slice(18, 21)),
            (slice(18, 21), slice(24, 27)),
        ):
            assert np.allclose((there - after)[rows] / 1e-6, J[error, k], atol=1e-4)


@pytest.mark.parametrize("hidden", range(3))
def test_the_point_known_best_lies_on_the_line_of_the_balls_that_are_seen(hidden: int) -> None:
    found = open_about(hidden, 0.3)
    middle, axis = body_line(hidden)
    off = best_known(found.mean, found.P) - middle
    assert np.linalg.norm(off - axis * (axis @ off)) < 1e-4


@pytest.mark.parametrize("hidden", range(3))
def test_pixels_say_nothing_of_the_open_turn_wherever_the_estimate_stands(hidden: int) -> None:
    """Turned on by 40 deg, the slope along the old open direction is still zero; the origin's would not be."""
    _, axis = body_line(hidden)
    ahead = predict(open_about(hidden, 0.3), 0, PROCESS).about_pivot()
    open_turn = np.concatenate((np.zeros(3), axis, np.zeros(19)))
    turned = ahead.state.moved(open_turn * np.radians(40.0))
    seen = tuple(s for s in sightings(FLYING, RIG, [(0, 0), (1, 0)], 0.1) if s.ball != hidden)
    before, after = (
        make_batch(Prediction(at, at.P, 0.0, PROCESS, ahead.pivot_inB), sighted(seen, 0), RIG).y
        for at in (ahead.state, turned)
    )
    assert np.abs(after - before).max() < 0.01


def test_the_slope_through_a_step_agrees_with_finite_differences() -> None:
    """Errors about the mean a step leads to, by errors of the step, where the step turns by 25 deg."""
    step = np.concatenate(([0.01, -0.02, 0.03], np.radians([20.0, -10.0, 12.0]), np.full(18, 0.1), [0.0]))
    E, J_r = np.empty((3, 3)), np.empty((3, 3))
    now = moved(FLYING.mean, step, E, J_r)
    G = moved_slope(FLYING.mean, now, E, J_r, 25)
    here = replace(FLYING, mean=now)
    for k in range(24):
        nudged = step.copy()
        nudged[k] += 1e-6
        there = replace(FLYING, mean=moved(FLYING.mean, nudged, np.empty((3, 3)), np.empty((3, 3))))
        found = np.concatenate(
            (
                difference(there, here),
                there.a_BinW - here.a_BinW,
                there.alpha_BinB - here.alpha_BinB,
                there.j_BinW - here.j_BinW,
                there.beta_BinB - here.beta_BinB,
            )
        )
        assert np.allclose(found / 1e-6, G[:24, k], atol=1e-4)


def test_a_turn_of_the_estimate_leaves_its_motion_in_the_room_alone() -> None:
    """Rate and angular acceleration about the room's axes, to all orders of a turn that says nothing of them."""
    turn = np.concatenate((np.zeros(3), np.radians([30.0, -20.0, 40.0]), np.zeros(19)))
    for rate, rows in ((FLYING.w_BinB, slice(9, 12)), (FLYING.alpha_BinB, slice(15, 18))):
        turn[rows] = np.cross(rate, turn[3:6])
    now = replace(FLYING, mean=moved(FLYING.mean, turn, np.empty((3, 3)), np.empty((3, 3))))
    assert np.allclose(now.R_BtoW @ now.w_BinB, FLYING.R_BtoW @ FLYING.w_BinB)
    assert np.allclose(now.R_BtoW @ now.alpha_BinB, FLYING.R_BtoW @ FLYING.alpha_BinB)


def test_a_closed_track_is_told_of_the_origin() -> None:
    ahead = predict(state(P=covariance(0.001, 0.001, 0.1, 0.3)), 0, PROCESS)
    assert ahead.about_pivot() is ahead
    assert not sag_covariance(ahead.state).any()


@pytest.mark.parametrize("hidden", range(3))
def test_the_reported_covariance_holds_the_circle_that_the_origin_runs_on(hidden: int) -> None:
    """Truths drawn from the filter's own belief, turned about the line exactly: none of 2000 beyond 5 sigma."""
    rng = np.random.default_rng(hidden)
    guess, (middle, axis) = open_about(hidden, np.radians(15.0)), body_line(hidden)
    P = guess.P[:6, :6].copy()
    P[:3, :3] += sag_covariance(guess)
    line_inW = guess.p_BinW + guess.R_BtoW @ middle
    errors = rng.normal(size=(2000, 7)) * np.array([1e-4] * 3 + [1e-3] * 3 + [np.radians(15.0)])
    distances = []
    for error in errors:
        turn = error[3:6] + error[6] * axis
        origin = line_inW + error[:3] - guess.R_BtoW @ Rotation.from_rotvec(turn).as_matrix() @ middle
        e = np.concatenate((origin - guess.p_BinW, turn))
        distances.append(float(e @ np.linalg.solve(P, e)))
    assert max(distances) < 39.5
    assert 4.0 < np.mean(distances) < 7.0


def test_the_ball_that_returns_passes_the_gate() -> None:
    """30 deg off, the hidden ball stands millimetres beside the tangent that the linear prediction lays."""
    hidden = 0
    truth = open_about(hidden, np.radians(15.0))
    middle, axis = body_line(hidden)
    turn = Rotation.from_rotvec(np.radians(30.0) * axis).as_matrix()
    guess = truth.with_parts(R_BtoW=truth.R_BtoW @ turn)
    guess = guess.with_parts(p_BinW=truth.p_BinW + (truth.R_BtoW - guess.R_BtoW) @ middle)
    guess = replace(guess, P=open_about(hidden, np.radians(15.0)).P)
    ahead = predict(guess, 0, PROCESS).about_pivot()
    batch = make_batch(ahead, sighted(sightings(truth, RIG, [(0, 0), (1, 0)], 0.05), 0), RIG)
    assert max(batch.distances2()) < 13.8
