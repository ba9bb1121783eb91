"""What the rays to the balls tell of the cameras, on sightings drawn from the model."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from tests.tracker.rigs import ring_rig, sightings, state
from tracker.health.agreement import Agreement, Odds, left_open
from tracker.health.rays import residuals
from tracker.health.sample import MOTION, linearised, take_sample
from tracker.maths import so3
from tracker.rig import Rig
from tracker.scene import Knock
from tracker.scene.knock import knocked
from tracker.state import OFFSETS, State
from tracker.types import Array

SIGMA_PX = 0.1


def bumped(rig: Rig, *knocks: Knock) -> Rig:
    """Return the rig as it truly stands after knocks."""
    cameras = list(rig.cameras)
    for knock in knocks:
        cameras[knock.camera] = knocked(cameras[knock.camera], knock)
    return replace(rig, cameras=tuple(cameras))


def drawn_knock(camera: int, rng: np.random.Generator) -> Knock:
    """Return a turn of 0.2 deg or a shift of 5 mm across the view, the picture's motion in any direction."""
    angle = rng.uniform(0.0, 2.0 * np.pi)
    x, y = math.cos(angle), math.sin(angle)
    if rng.random() < 0.5:
        return Knock(camera, turn_deg=(0.2 * x, 0.2 * y, 0.0))
    return Knock(camera, shift_mm=(5.0 * x, 5.0 * y, 0.0))


def flight(count: int, cameras: int, seed: int) -> Iterator[State]:
    """Yield states all over the room."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        place, angles, P = rng.uniform(-0.3, 0.3, 3), rng.uniform(-20, 20, 3), 1e-12 * np.eye(OFFSETS + cameras - 1)
        yield state(p_BinW=place, euler_deg=angles, P=P, cameras=cameras)


def told(rig: Rig, *knocks: Knock, seed: int = 1, before: int = 10, faults: Array | None = None) -> Odds:
    """Fly well for some samples, then with knocks; return the last verdict."""
    agreement, rng, odds = Agreement(len(rig.cameras), faults), np.random.default_rng(seed), Odds(at_odds=False)
    for k, true in enumerate(flight(before + 6, len(rig.cameras), seed)):
        stands = bumped(rig, *knocks) if k >= before else rig
        seen = sightings(true, stands, [(c, 0) for c in range(len(rig.cameras))], SIGMA_PX, rng)
        sample = take_sample(seen, true, rig, SIGMA_PX)
        assert sample is not None
        odds = agreement.add(sample)
    return odds


@pytest.mark.parametrize("knock", [Knock(1, turn_deg=(0.0, 0.2, 0.0)), Knock(3, shift_mm=(5.0, 0.0, 0.0))])
def test_of_four_cameras_the_one_that_was_bumped_is_named_without_any_room(knock: Knock) -> None:
    assert told(ring_rig(4), knock) == Odds(True, (knock.camera,))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("pair", list(combinations(range(4), 2)))
def test_of_two_that_were_bumped_at_once_no_other_is_ever_named(pair: tuple[int, int], seed: int) -> None:
    rng = np.random.default_rng((*pair, seed))
    odds = told(ring_rig(4), *(drawn_knock(camera, rng) for camera in pair), seed=seed)
    assert odds.at_odds
    assert set(odds.suspects) <= set(pair)


def test_two_of_five_that_were_bumped_at_once_are_both_named() -> None:
    knocks = Knock(1, turn_deg=(0.0, 0.2, 0.0)), Knock(3, shift_mm=(5.0, 0.0, 0.0))
    assert told(ring_rig(5), *knocks) == Odds(True, (1, 3))


@pytest.mark.parametrize("knock", [Knock(1, turn_deg=(0.2, 0.0, 0.0)), Knock(2, shift_mm=(0.0, 5.0, 0.0))])
def test_a_camera_bumped_since_the_room_was_calibrated_is_named_from_the_first_samples_on(knock: Knock) -> None:
    rig = ring_rig(4)
    assert told(rig, knock, before=0, faults=left_open(0.05, rig)) == Odds(True, (knock.camera,), from_start=True)
    assert told(rig, knock, before=0) == Odds(
        at_odds=False
    )  # without a room file it is taken for the calibration's own


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("cameras", [2, 4])
def test_cameras_that_stand_as_calibrated_are_not_at_odds(cameras: int, seed: int) -> None:
    rig = ring_rig(cameras)
    assert told(rig, seed=seed, before=0, faults=left_open(0.05, rig)) == Odds(at_odds=False)


def test_a_clock_that_is_not_known_yet_is_no_bump() -> None:
    rig, P = ring_rig(3), np.diag(np.append(np.full(OFFSETS, 1e-6), [0.02, 0.02]) ** 2)
    agreement, odds = Agreement(3, left_open(0.05, rig)), Odds(at_odds=False)
    for still in flight(6, 3, 1):
        moving = replace(still.with_parts(v_BinW=np.array([0.6, -0.8, 0.3])), P=P)
        seen = [one._replace(t_ns=0) for one in sightings(moving, rig, [(0, 0), (1, 15_000_000), (2, 0)], SIGMA_PX)]
        sample = take_sample(seen, moving, rig, SIGMA_PX)
        assert sample is not None
        odds = agreement.add(sample)
    assert odds == Odds(at_odds=False)


def test_of_two_cameras_nobody_can_tell_which_was_bumped() -> None:
    assert told(ring_rig(2), Knock(1, turn_deg=(0.0, 0.3, 0.0))) == Odds(at_odds=True)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("cameras", [2, 4])
def test_cameras_that_stand_still_are_not_at_odds(cameras: int, seed: int) -> None:
    assert told(ring_rig(cameras), seed=seed) == Odds(at_odds=False)


def test_the_slope_by_a_cameras_motion_is_that_of_finite_differences() -> None:
    rig, true, step = ring_rig(2), next(flight(1, 2, 3)), 1e-6
    seen = sightings(true, rig, [(0, 0), (1, 0)], SIGMA_PX)
    one = linearised(seen, true, rig, SIGMA_PX)
    assert one is not None
    for k in range(MOTION):
        d = step * np.eye(MOTION)[k]
        camera = rig.cameras[1]
        moved = replace(camera, p_CinW=camera.p_CinW + d[:3], R_CtoW=so3.exp(d[3:]) @ camera.R_CtoW)
        other = linearised(seen, true, replace(rig, cameras=(rig.cameras[0], moved)), SIGMA_PX)
        assert other is not None
        assert np.allclose((one.r - other.r) / step, one.D[:, MOTION + k], rtol=1e-3, atol=1e-4 * np.abs(one.D).max())


def test_rays_that_meet_have_no_residuals_and_a_bump_shows_in_pixels() -> None:
    rig, true = ring_rig(2), next(flight(1, 2, 4))
    off_px, longer_m = residuals(sightings(true, rig, [(0, 0), (1, 0)], SIGMA_PX), rig)
    assert np.abs(off_px).max() < 1e-6
    assert np.abs(longer_m).max() < 1e-9
    after = bumped(rig, Knock(1, turn_deg=(0.0, 0.2, 0.0)))
    off_px, _ = residuals(sightings(true, after, [(0, 0), (1, 0)], SIGMA_PX), rig)
    assert np.abs(off_px) == pytest.approx(np.full(3, rig.cameras[1].focal_px * np.radians(0.2)), rel=0.1)


@pytest.mark.parametrize("balls", [2, 3])
def test_a_sample_holds_what_no_other_pose_explains_even_where_two_balls_leave_a_turn_open(balls: int) -> None:
    """Beside the projection by pseudo-inverse, the clocks being known."""
    rig, rng = ring_rig(2), np.random.default_rng(4)
    for true in flight(5, 2, seed=6):
        everything = sightings(true, rig, [(c, 0) for c in range(2)], SIGMA_PX, rng)
        seen = [one for one in everything if one.ball < balls]
        one, sample = linearised(seen, true, rig, SIGMA_PX), take_sample(seen, true, rig, SIGMA_PX)
        assert one is not None
        assert sample is not None
        within = one.J @ np.linalg.pinv(one.J, rcond=1e-9)
        left = one.D - within @ one.D
        np.testing.assert_allclose(sample.N, left.T @ left, atol=1e-6 * np.abs(sample.N).max())
        np.testing.assert_allclose(sample.g, left.T @ one.r, atol=1e-6 * np.abs(one.D.T @ one.r).max())
