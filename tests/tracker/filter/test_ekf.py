"""The filter: honest about its errors, stubborn against liars, exact about each camera's own time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from tests.tracker.rigs import (
    PROCESS,
    SECOND_NS,
    at,
    covariance,
    difference,
    perturbed,
    ring_rig,
    sightings,
    state,
)
from tracker.filter import ekf
from tracker.filter.batch import make_batch, sighted
from tracker.filter.ekf import Update
from tracker.filter.manoeuvre import envelope
from tracker.filter.matern import process_noise
from tracker.filter.measure import predicted_pixels
from tracker.filter.predict import Prediction, first_guess, predict
from tracker.rig import Rig
from tracker.state import State
from tracker.types import Array, BallSighting, Reason, Rejected, frozen_array

RIG = ring_rig(2)
SIGMA_PX = 0.1
PERIOD_NS = 33_333_333
OPEN = 1.0 - 1e-9  # a gate that lets every true sighting pass
GATE = 0.999
AT_FIRST_SIGHT = covariance(0.05, 0.3, 2.5, 1.6)
BRISKEST = process_noise(25, PERIOD_NS * 1e-9, PROCESS.manoeuvre_s, envelope(PROCESS))
NOISE = BRISKEST + 1e-18 * np.eye(25)
FLYING = state(0, (0.2, -0.1, 0.1), (12.0, -8.0, 130.0), (1.0, -0.5, 0.3), (0.4, -0.8, 1.5))


def update(
    ahead: State | Prediction, seen: tuple[BallSighting, ...], rig: Rig, probability: float
) -> Update | Rejected:
    """Update a prediction, or a state that is taken for one."""
    return ekf.update(first_guess(ahead, PROCESS) if isinstance(ahead, State) else ahead, seen, rig, probability)


def updated(found: Update | Rejected) -> Update:
    assert isinstance(found, Update), found
    return found


def drawn(rng: np.random.Generator, P: Array) -> Array:
    return np.asarray(np.linalg.cholesky(P) @ rng.normal(size=len(P)))


def nees(truth: State, found: State) -> float:
    error = difference(truth, found)
    return float(error @ np.linalg.solve(found.P[:12, :12], error))


def test_free_running_cameras_give_no_bias_at_full_speed() -> None:
    """At 1.5 m/s frames 16.7 ms apart are 25 mm apart: taken for one instant they would show."""
    rng = np.random.default_rng(4)
    truth = state(0, (-0.4, 0.0, 0.1), v_BinW=(1.5, 0.0, 0.0))
    errors = []
    for _ in range(8):
        guess = replace(perturbed(truth, drawn(rng, AT_FIRST_SIGHT) * 0.3), P=AT_FIRST_SIGHT)
        for k in range(1, 17):
            t_ns = k * PERIOD_NS // 2
            seen = sightings(truth, RIG, [(k % 2, t_ns)], SIGMA_PX, rng)
            guess = updated(update(predict(guess, t_ns, PROCESS), seen, RIG, OPEN)).state
        errors.append(difference(at(truth, guess.t_ns), guess)[:3])
    assert np.abs(np.mean(errors, axis=0)).max() < 0.001
    assert np.abs(errors).max() < 0.004


def test_a_ball_hidden_for_a_tenth_of_a_second_costs_millimetres_and_its_return_mends_it() -> None:
    """Two balls do not show the turn about their line; the filter's sigmas are no guide there, so errors are told."""
    rng = np.random.default_rng(6)
    worst_m = 0.0
    for _ in range(20):
        truth = replace(FLYING, P=covariance(0.001, 0.01, 0.1, 0.3))
        guess = perturbed(truth, drawn(rng, truth.P))
        for k in range(5):
            t_ns = (k + 1) * PERIOD_NS
            truth = perturbed(
                at(truth, t_ns),
                drawn(rng, NOISE),
            )
            seen = sightings(truth, RIG, [(0, t_ns), (1, t_ns)], SIGMA_PX, rng)
            seen = tuple(s for s in seen if s.ball != 1 or k > 2)
            guess = updated(update(predict(guess, t_ns, PROCESS), seen, RIG, OPEN)).state
            worst_m = max(worst_m, float(np.linalg.norm(difference(truth, guess)[:3])))
        assert np.linalg.norm(difference(truth, guess)[:3]) < 0.002
        assert np.linalg.norm(difference(truth, guess)[3:6]) < np.radians(2.0)
    assert worst_m < 0.04


@pytest.mark.parametrize("seed", range(20))
def test_a_second_of_one_camera_and_one_hidden_ball_costs_accuracy_and_not_the_track(seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth, guess = FLYING, replace(FLYING, P=covariance(0.001, 0.01, 0.05, 0.2))
    for k in range(1, 31):
        seen = tuple(s for s in sightings(truth, RIG, [(0, k * PERIOD_NS)], SIGMA_PX, rng) if s.ball != k // 10)
        guess = updated(update(predict(guess, k * PERIOD_NS, PROCESS), seen, RIG, GATE)).state
    assert nees(at(truth, guess.t_ns), guess) < chi2.ppf(GATE, 12)
    assert np.linalg.norm(difference(at(truth, guess.t_ns), guess)[:3]) < 0.03


def test_one_camera_does_not_carry_a_track_out_of_the_envelope_alone() -> None:
    """A jump within one camera's gates and beyond the other's: it is no manoeuvre, and no camera's mistake."""
    ahead = predict(replace(FLYING, P=covariance(1e-4, 1e-3, 0.01, 0.01)), PERIOD_NS, PROCESS)
    across_inW, _, along_inW = RIG.cameras[0].R_CtoW.T
    sigma_m = np.sqrt(along_inW @ (ahead.P_coasted + BRISKEST)[:3, :3] @ along_inW)
    jump_inW = sigma_m * (3.0 * across_inW + 4.3 * along_inW)
    jumped = ahead.state.with_parts(p_BinW=ahead.state.p_BinW + jump_inW)
    seen = sightings(jumped, RIG, [(0, PERIOD_NS), (1, PERIOD_NS)], SIGMA_PX)
    distances2 = make_batch(ahead, sighted(seen, PERIOD_NS), RIG).distances2()
    near = [distance2 < chi2.ppf(GATE, 2) for distance2 in distances2]
    assert near == [sighting.camera == 0 for sighting in seen]
    assert isinstance(update(ahead, seen, RIG, GATE), Rejected)


def lie(seen: tuple[BallSighting, ...], index: int, shift_px: tuple[float, float]) -> tuple[BallSighting, ...]:
    moved = seen[index]._replace(uv_px=frozen_array(seen[index].uv_px + shift_px))
    return (*seen[:index], moved, *seen[index + 1 :])


@pytest.mark.parametrize("shift_px", [(30.0, 0.0), (0.0, -30.0), (3.0, 0.0), (0.0, 3.0), (-2.1, 2.1)])
@pytest.mark.parametrize("index", range(6))
def test_one_false_sighting_is_left_out_and_the_rest_used(index: int, shift_px: tuple[float, float]) -> None:
    seen = sightings(FLYING, RIG, [(0, 0), (1, 0)], SIGMA_PX, np.random.default_rng(index))
    found = updated(update(FLYING, lie(seen, index, shift_px), RIG, GATE))
    assert [(s.camera, s.ball) for s in found.used] == [(s.camera, s.ball) for s in seen if s is not seen[index]]
    (rejected,) = found.rejected
    assert (rejected.reason, rejected.camera) == (Reason.GATE, seen[index].camera)
    assert RIG.marker.balls[seen[index].ball].name in rejected.detail
    assert found.dof == 10
    without = updated(update(FLYING, (*seen[:index], *seen[index + 1 :]), RIG, GATE))
    assert np.allclose(difference(without.state, found.state), 0.0, atol=1e-9)


def test_two_colours_swapped_in_one_camera_are_left_out_and_the_rest_used() -> None:
    seen = sightings(FLYING, RIG, [(0, 0), (1, 0)], SIGMA_PX, np.random.default_rng(0))
    swapped = (seen[0]._replace(ball=1), seen[1]._replace(ball=0), *seen[2:])
    found = updated(update(FLYING, swapped, RIG, GATE))
    assert {(s.camera, s.ball) for s in found.used} == {(0, 2), (1, 0), (1, 1), (1, 2)}
    assert len(found.rejected) == 2


@pytest.mark.parametrize("index", range(6))
def test_a_lie_is_found_by_the_markers_shape_when_the_track_itself_is_vague(index: int) -> None:
    """At first sight 3 px lie well within the prediction's own doubt; the rigid marker tells."""
    rng = np.random.default_rng(index)
    start = replace(perturbed(FLYING, np.array([0.02, -0.01, 0.01, 0.05, -0.05, 0.1, *np.zeros(6)])), P=AT_FIRST_SIGHT)
    seen = sightings(FLYING, RIG, [(0, 0), (1, 0)], SIGMA_PX, rng)
    found = updated(update(start, lie(seen, index, (3.0, 3.0)), RIG, GATE))
    assert len(found.used) < 6
    assert np.linalg.norm(difference(FLYING, found.state)[:3]) < 0.002


@pytest.mark.parametrize("stale", [0, 1])
@pytest.mark.parametrize("seed", range(10))
def test_a_camera_that_shows_what_it_saw_before_makes_no_pose_wrong(stale: int, seed: int) -> None:
    """Its balls keep the marker's shape; two of them left out, the third would pull the pose to between the cameras."""
    rng, period_ns = np.random.default_rng(seed), 2 * PERIOD_NS
    truth = FLYING.with_parts(v_BinW=rng.uniform(-0.8, 0.8, 3), w_BinB=rng.uniform(-1.0, 1.0, 3))
    guess = replace(truth, P=covariance(0.001, 0.01, 0.05, 0.2))
    for k in range(1, 16):
        seen = sightings(truth, RIG, [(0, k * period_ns), (1, k * period_ns)], SIGMA_PX, rng)
        guess = updated(update(predict(guess, k * period_ns, PROCESS), seen, RIG, GATE)).state
    now_ns = 16 * period_ns
    views = [(camera, now_ns - period_ns * (camera == stale)) for camera in (0, 1)]
    seen = tuple(s._replace(t_ns=now_ns) for s in sightings(truth, RIG, views, SIGMA_PX, rng))
    found = update(predict(guess, now_ns, PROCESS), seen, RIG, GATE)
    if isinstance(found, Update):
        error = difference(at(truth, now_ns), found.state)[:6]
        assert error @ np.linalg.solve(found.state.P[:6, :6], error) < 39.5


def test_sightings_of_another_place_are_rejected_as_a_whole() -> None:
    elsewhere = state(0, (-0.3, 0.2, 0.0), (0.0, 0.0, -50.0))
    found = update(FLYING, sightings(elsewhere, RIG, [(0, 0), (1, 0)], SIGMA_PX), RIG, GATE)
    assert isinstance(found, Rejected)
    assert found.reason is Reason.FRAME_GATE


def test_a_frame_of_lies_is_rejected_as_a_whole() -> None:
    rng = np.random.default_rng(2)
    seen = sightings(FLYING, RIG, [(0, 0), (1, 0)], SIGMA_PX, rng)
    for index in range(6):
        seen = lie(seen, index, tuple(rng.choice([-4.0, 4.0], 2)))
    found = update(FLYING, seen, RIG, GATE)
    assert isinstance(found, Rejected)
    assert found.reason is Reason.FRAME_GATE


def test_no_sightings_are_no_update() -> None:
    found = update(FLYING, (), RIG, GATE)
    assert isinstance(found, Rejected)
    assert found.reason is Reason.FRAME_GATE


def test_a_ball_said_to_be_behind_the_camera_is_left_out() -> None:
    camera = RIG.cameras[0]
    start = state(0, camera.p_CinW - camera.R_CtoW[:, 2], P=covariance(10.0, 1.0, 1.0, 1.0))
    found = update(start, sightings(FLYING, RIG, [(0, 0)], SIGMA_PX), RIG, GATE)
    assert isinstance(found, Rejected)


@pytest.mark.parametrize("seed", range(5))
def test_the_iterated_update_beats_the_single_linear_step_for_a_poor_prior(seed: int) -> None:
    """10 deg and 50 mm off: the pixels bend over such a distance."""
    rng = np.random.default_rng(seed)
    turn, shift = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    error = np.concatenate((0.05 * shift, np.radians(10.0) * turn, np.zeros(6)))
    start = replace(perturbed(FLYING, error), P=AT_FIRST_SIGHT)
    seen = sightings(FLYING, RIG, [(0, 0), (1, 0)], SIGMA_PX)
    iterated = updated(update(start, seen, RIG, OPEN)).state
    single = single_step(start, seen)
    worse, better = (np.abs(difference(FLYING, s)[:6]) for s in (single, iterated))
    assert better[:3].max() < min(1e-4, 0.2 * worse[:3].max())
    assert better[3:].max() < min(1e-3, 0.2 * worse[3:].max())


def single_step(start: State, seen: tuple[BallSighting, ...]) -> State:
    """Update by the textbook's linear step."""
    predicted = [predicted_pixels(start, RIG, s.camera, s.t_ns) for s in seen]
    z = np.concatenate([s.uv_px for s in seen])
    h = np.concatenate([uv_px[s.ball] for s, (uv_px, _) in zip(seen, predicted, strict=True)])
    H = np.concatenate([slope[s.ball] for s, (_, slope) in zip(seen, predicted, strict=True)])
    S = H @ start.P @ H.T + SIGMA_PX**2 * np.eye(len(z))
    return perturbed(start, start.P @ H.T @ np.linalg.solve(S, z - h))


@pytest.mark.parametrize("seed", range(4))
def test_the_update_is_the_most_likely_state_between_prior_and_pixels(seed: int) -> None:
    """Against scipy's own least squares: rough pixels, a prior surer of some turns than of others, 30 deg off."""
    rng = np.random.default_rng(seed)
    sigmas = [0.03, 0.03, 0.03, 0.04, 0.15, 0.3, 0.3, 0.3, 0.3, 0.5, 0.5, 0.5]
    P, sigma_px = np.diag(np.square([*sigmas, *[1e-6] * 13])), 8.0
    start = replace(perturbed(FLYING, 2.0 * drawn(rng, P)), P=P)
    seen = sightings(FLYING, RIG, [(0, 0), (1, 30_000_000)], sigma_px, rng)
    root = np.sqrt(np.diag(P))

    def put_in(error: Array) -> State:
        """Put an error in; rates are told as the room sees them, which is how the filter's prior speaks of them."""
        turn = Rotation.from_rotvec(error[3:6]).as_matrix()
        w_BinB = turn.T @ (start.w_BinB + error[9:12] + np.cross(error[3:6], start.w_BinB))
        return perturbed(start, error).with_parts(w_BinB=w_BinB)

    def misfit(scaled: Array) -> Array:
        guess = sightings(put_in(scaled * root), RIG, [(0, 0), (1, 30_000_000)], sigma_px)
        pixels = [(s.uv_px - g.uv_px) / sigma_px for s, g in zip(seen, guess, strict=True)]
        return np.concatenate((scaled, *pixels))

    likeliest = put_in(least_squares(misfit, np.zeros(25), xtol=1e-12).x * root)
    found = updated(update(start, seen, RIG, OPEN)).state
    off = difference(likeliest, found)
    assert np.sqrt(off @ np.linalg.solve(found.P[:12, :12], off)) < 0.005


def test_a_prediction_grows_by_the_process_and_moves_with_the_velocity() -> None:
    ahead = predict(FLYING, SECOND_NS // 10, PROCESS).state
    assert np.allclose(difference(at(FLYING, SECOND_NS // 10), ahead), 0.0, atol=1e-12)
    assert (np.diag(ahead.P) > np.diag(FLYING.P))[:12].all()
    assert np.linalg.eigvalsh(ahead.P).min() > 0.0


def test_predicting_no_further_changes_nothing() -> None:
    same = predict(FLYING, FLYING.t_ns, PROCESS).state
    assert np.array_equal(same.P, FLYING.P)
    assert np.array_equal(same.p_BinW, FLYING.p_BinW)


def test_predicting_back_is_a_mistake_of_the_programmer() -> None:
    with pytest.raises(ValueError, match="cannot predict back"):
        predict(FLYING, FLYING.t_ns - 1, PROCESS)


def test_what_goes_in_is_left_as_it_was() -> None:
    before = (FLYING.P.copy(), FLYING.p_BinW.copy(), FLYING.R_BtoW.copy())
    update(predict(FLYING, 5, PROCESS), sightings(FLYING, RIG, [(0, 0)], SIGMA_PX), RIG, GATE)
    assert np.array_equal(FLYING.P, before[0])
    assert np.array_equal(FLYING.p_BinW, before[1])
    assert np.array_equal(FLYING.R_BtoW, before[2])
