"""What the rays to the balls tell of the cameras, on sightings drawn from the model."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.rigs import ring_rig, sightings, state
from tracker.health.agreement import Agreement, Odds
from tracker.health.rays import residuals
from tracker.health.sample import MOTION, linearised, take_sample
from tracker.maths import so3
from tracker.rig import Rig
from tracker.scene import Knock
from tracker.scene.knock import knocked
from tracker.state import State

SIGMA_PX = 0.1


def bumped(rig: Rig, knock: Knock | None) -> Rig:
    """Return the rig as it truly stands after a knock."""
    cameras = tuple(knocked(c, knock) if knock and i == knock.camera else c for i, c in enumerate(rig.cameras))
    return replace(rig, cameras=cameras)


def flight(count: int, cameras: int, seed: int) -> Iterator[State]:
    """Yield states all over the room."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield replace(
            state(p_BinW=rng.uniform(-0.3, 0.3, 3), euler_deg=rng.uniform(-20, 20, 3)), offsets_s=np.zeros(cameras)
        )


def told(rig: Rig, knock: Knock | None, seed: int = 1) -> Odds:
    """Fly well for a while, then with the knock; return the last verdict."""
    agreement, rng, odds = Agreement(len(rig.cameras)), np.random.default_rng(seed), Odds(False, None)
    for k, true in enumerate(flight(16, len(rig.cameras), seed)):
        seen = sightings(
            true, bumped(rig, knock if k >= 10 else None), [(c, 0) for c in range(len(rig.cameras))], SIGMA_PX, rng
        )
        sample = take_sample(seen, true, rig, SIGMA_PX)
        assert sample is not None
        odds = agreement.add(sample)
    return odds


@pytest.mark.parametrize("knock", [Knock(1, turn_deg=(0.0, 0.2, 0.0)), Knock(3, shift_mm=(5.0, 0.0, 0.0))])
def test_of_four_cameras_the_one_that_was_bumped_is_named_without_any_room(knock: Knock) -> None:
    assert told(ring_rig(4), knock) == Odds(True, knock.camera)


def test_of_two_cameras_nobody_can_tell_which_was_bumped() -> None:
    assert told(ring_rig(2), Knock(1, turn_deg=(0.0, 0.3, 0.0))) == Odds(True, None)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("cameras", [2, 4])
def test_cameras_that_stand_still_are_not_at_odds(cameras: int, seed: int) -> None:
    assert told(ring_rig(cameras), None, seed) == Odds(False, None)


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
