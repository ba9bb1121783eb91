"""The colour of the light is told by what changes in all balls at once."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracker.image.tint import AROUND, LEARN_BALLS, NEUTRAL, UNITY, Bgr, Gains, Tint, core_colour

PAINTS = {0: np.array([46.0, 161.0, 166.0]), 1: np.array([52.0, 128.0, 43.0]), 2: np.array([36.0, 89.0, 165.0])}
"""Yellow, green, orange, BGR."""
gain = st.floats(0.75, 1.35)


def under(gains: Gains, brightness: float = 1.0) -> list[tuple[int, Bgr]]:
    """Return what each ball looks like in a light."""
    seen = {ball: brightness * bgr * (gains.blue, 1.0, gains.red) for ball, bgr in PAINTS.items()}
    return [(ball, (blue, green, red)) for ball, (blue, green, red) in seen.items()]


def used_to(gains: Gains) -> Tint:
    """Return a tint that has learned the balls' own colours in a light it knows."""
    tint = Tint(gains)
    for _ in range(LEARN_BALLS):
        tint = tint.learned(under(gains))
    return tint


@given(gain, gain, st.floats(0.5, 1.4))
def test_a_light_that_changes_is_followed_whatever_its_brightness(blue: float, red: float, brightness: float) -> None:
    tint = used_to(NEUTRAL)
    for _ in range(8):
        tint = tint.learned(under(Gains(blue, red), brightness))
    assert tint.gains.blue == pytest.approx(blue, rel=0.02)
    assert tint.gains.red == pytest.approx(red, rel=0.02)


@given(gain, gain)
def test_one_ball_tells_the_light_for_all(blue: float, red: float) -> None:
    tint = used_to(NEUTRAL)
    for _ in range(8):
        tint = tint.learned(under(Gains(blue, red))[:1])
    assert tint.gains.red == pytest.approx(red, rel=0.02)


def test_while_the_balls_own_colours_are_learned_the_light_stays() -> None:
    tint = Tint()
    for _ in range(LEARN_BALLS):
        tint = tint.learned(under(Gains(1.2, 0.8)))
    assert tint.gains == NEUTRAL


def test_a_light_known_from_elsewhere_is_no_part_of_the_balls_own_colours() -> None:
    tint = used_to(Gains(0.8, 1.2))
    for _ in range(8):
        tint = tint.learned(under(NEUTRAL))
    assert tint.gains.blue == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize("level", [0.0, math.nan])
def test_a_colour_with_a_black_channel_tells_nothing(level: float) -> None:
    tint = used_to(NEUTRAL)
    assert tint.learned([(0, (level, 120.0, 130.0))]).gains == tint.gains


def test_the_room_shining_into_a_dark_channel_is_no_light() -> None:
    """Before a red wall a green ball's red, through blur, is half as strong again."""
    tint = used_to(NEUTRAL)
    shone = [(ball, (blue + 2.0, green + 2.0, red + 20.0)) for ball, (blue, green, red) in under(NEUTRAL)]
    for _ in range(8):
        tint = tint.learned(shone)
    assert tint.gains.red == pytest.approx(1.0, abs=0.15)


def test_absurd_gains_are_held_at_a_limit() -> None:
    tint = used_to(NEUTRAL)
    for _ in range(50):
        tint = tint.learned(under(Gains(20.0, 0.1)))
    assert 1.0 < tint.gains.blue < 2.5
    assert 0.4 < tint.gains.red < 1.0


def test_other_lights_come_nearest_first_and_are_all_different() -> None:
    others = [Tint(Gains(0.9, 1.1)).other(number) for number in range(len(AROUND))]
    distances = [math.hypot(math.log(one.blue / 0.9), math.log(one.red / 1.1)) for one in others]
    assert distances == pytest.approx(sorted(distances))
    assert distances[0] > 0.1
    assert len({(one.blue, one.red) for one in others}) == len(others) == 24


def test_undoing_turns_a_tinted_pixel_back() -> None:
    blue, red = Gains(0.8, 1.333).undoing
    assert 80 * blue // UNITY == 100
    assert 133 * red // UNITY == pytest.approx(100, abs=4)


def test_slight_tints_are_left_alone() -> None:
    assert Gains(1.1, 0.9).undoing == (UNITY, UNITY)


def test_the_core_of_a_ball_has_its_paints_colour_whatever_is_behind() -> None:
    image = np.full((40, 40, 3), (200, 30, 90), np.uint8)
    cv2.circle(image, (20, 18), 5, (46, 161, 166), -1, cv2.LINE_AA)
    np.testing.assert_allclose(core_colour(image, 20.0, 18.0, 5.0), (46.0, 161.0, 166.0))


def test_clipped_pixels_are_left_out_and_a_ball_of_them_has_no_colour() -> None:
    image = np.full((40, 40, 3), (46, 161, 166), np.uint8)
    image[18, 20] = (255, 255, 255)
    np.testing.assert_allclose(core_colour(image, 20.0, 18.0, 3.0), (46.0, 161.0, 166.0))
    image[:] = 255
    assert np.isnan(core_colour(image, 20.0, 18.0, 3.0)).all()


def test_a_ball_at_the_border_has_the_colour_of_what_is_seen_of_it() -> None:
    image = np.full((20, 20, 3), (10, 20, 30), np.uint8)
    np.testing.assert_allclose(core_colour(image, 0.0, 19.0, 4.0), (10.0, 20.0, 30.0))
