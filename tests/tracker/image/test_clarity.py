"""What the light may be wrong by goes with how clearly balls show."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracker.image.clarity import LOOKS, SHARE, UNKNOWN_PX, Clarity

CLEAR, DIM = 0.02, 0.1
"""One sigma of a centre [px]."""


def shown(*looks_px: float, balls: int = 3) -> Clarity:
    clarity = Clarity(2)
    for sigma_px in looks_px:
        clarity.take(1, [sigma_px**2] * balls)
    return clarity


def test_a_camera_that_has_not_looked_is_taken_for_a_dim_one() -> None:
    assert shown(CLEAR).light_px == pytest.approx([SHARE * UNKNOWN_PX, SHARE * CLEAR])


@given(st.floats(0.005, 0.5))
def test_light_is_as_unsure_as_the_centres_it_is_learned_from(sigma_px: float) -> None:
    assert shown(*[sigma_px] * LOOKS).light_px[1] == pytest.approx(SHARE * sigma_px)


def test_it_follows_balls_that_come_to_show_less_clearly_and_takes_one_look_for_chance() -> None:
    before, chance = shown(*[CLEAR] * LOOKS).light_px[1], shown(*[CLEAR] * LOOKS, DIM).light_px[1]
    after = shown(*[CLEAR] * LOOKS, *[DIM] * 3 * LOOKS).light_px[1]
    assert before < chance < SHARE * DIM / 2.0 < 0.9 * SHARE * DIM < after


def test_a_ball_hidden_in_part_does_not_make_the_light_unsure() -> None:
    clarity = Clarity(1)
    for variances_px2 in np.random.default_rng(1).permuted(np.tile((CLEAR**2, CLEAR**2, 1.0), (LOOKS, 1)), axis=1):
        clarity.take(0, variances_px2.tolist())
    assert clarity.light_px == pytest.approx([SHARE * CLEAR])


def test_a_look_without_a_ball_tells_nothing() -> None:
    clarity = shown(CLEAR)
    clarity.take(1, [])
    assert clarity.light_px == shown(CLEAR).light_px
