"""What light may be wrong by goes with how clearly balls show, and with how far the cameras contradict each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tracker.rigs import ring_rig, sightings, state
from tracker.filter.measure import predicted_pixels
from tracker.image.clarity import LOOKS, SHARE, UNKNOWN_PX, Clarity
from tracker.rig import Rig
from tracker.state import POSITION, State
from tracker.types import BallSighting

RIG = ring_rig(2)
CLEAR_PX, DIM_PX = 0.02, 0.1
"""One sigma of a centre."""


def shown(*looks_px: float) -> Clarity:
    """Return what camera 1 tells, alone, by looks as clear as that."""
    clarity = Clarity(2)
    for sigma_px in looks_px:
        clarity.take(sightings(state(), RIG, [(1, 0)], sigma_px), state(), RIG)
    return clarity


def placed(seen: Sequence[BallSighting], rig: Rig) -> State:
    """Return the state that differs from the true one by the position alone that fits sightings best."""
    expected = [predicted_pixels(state(cameras=len(rig.cameras)), rig, one.camera, one.t_ns) for one in seen]
    off_px = np.concatenate([one.uv_px - uv_px[one.ball] for one, (uv_px, _) in zip(seen, expected, strict=True)])
    slopes = np.concatenate([H[one.ball][:, POSITION] for one, (_, H) in zip(seen, expected, strict=True)])
    return state(p_BinW=np.linalg.lstsq(slopes, off_px, rcond=None)[0], cameras=len(rig.cameras))


def contradicting(cameras: int, shared_px: float, sigma_px: float, rng: np.random.Generator) -> float:
    """Return what is said of cameras whose balls are all off together by noise of so many pixels, new in each look."""
    rig, clarity, said_px2 = ring_rig(cameras), Clarity(cameras), []
    for _ in range(40 * LOOKS):
        seen = sightings(state(cameras=cameras), rig, [(k, 0) for k in range(cameras)], sigma_px, rng)
        off_px = rng.normal(scale=shared_px, size=(cameras, 2))
        seen = tuple(one._replace(uv_px=one.uv_px + off_px[one.camera]) for one in seen)
        clarity.take(seen, placed(seen, rig), rig)
        said_px2.append(clarity.light_px[0] ** 2)
    return float(np.sqrt(np.mean(said_px2)))


def test_a_camera_that_has_not_looked_is_taken_for_a_dim_one() -> None:
    assert shown(CLEAR_PX).light_px == pytest.approx([SHARE * UNKNOWN_PX, SHARE * CLEAR_PX])


@given(st.floats(0.005, 0.5))
def test_light_is_as_unsure_as_the_centres_it_is_learned_from(sigma_px: float) -> None:
    assert shown(*[sigma_px] * LOOKS).light_px[1] == pytest.approx(SHARE * sigma_px)


def test_it_follows_balls_that_come_to_show_less_clearly_and_takes_one_look_for_chance() -> None:
    clear = [CLEAR_PX] * LOOKS
    before, chance = shown(*clear).light_px[1], shown(*clear, DIM_PX).light_px[1]
    after = shown(*clear, *[DIM_PX] * 3 * LOOKS).light_px[1]
    assert before < chance < SHARE * DIM_PX / 2.0 < 0.9 * SHARE * DIM_PX < after


def test_a_ball_hidden_in_part_does_not_make_the_light_unsure() -> None:
    clarity, seen = Clarity(2), sightings(state(), RIG, [(1, 0)], CLEAR_PX)
    doubted = seen[0]._replace(cov_px=seen[0].cov_px + np.eye(2))
    for _ in range(LOOKS):
        clarity.take((doubted, *seen[1:]), state(), RIG)
    assert clarity.light_px[1] == pytest.approx(SHARE * CLEAR_PX)


@pytest.mark.parametrize("cameras", [2, 3, 5])
def test_what_all_balls_of_a_camera_are_off_by_shows_where_cameras_contradict_each_other(cameras: int) -> None:
    """Whatever the reason: light, gloss, a clock, a knock."""
    said_px = contradicting(cameras, DIM_PX, CLEAR_PX, np.random.default_rng(cameras))
    assert said_px == pytest.approx(DIM_PX, rel=0.2)


def test_cameras_that_agree_but_for_noise_say_what_their_noise_says() -> None:
    said_px = contradicting(2, 0.0, DIM_PX, np.random.default_rng(4))
    assert said_px == pytest.approx(SHARE * DIM_PX, rel=0.2)
