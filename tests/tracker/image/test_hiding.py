"""How much of a ball is hidden, told from its image alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.drawing import developed, draw_ball, draw_band, empty_canvas, through_jpeg
from tests.tracker.image.test_centre import BALL, CAMERA, RADIUS_PX, accustomed, expected
from tracker.image.appearance import Appearance
from tracker.image.centre import Centre, fit_centre, numbers_of, templates_of
from tracker.image.hiding import (
    AT_ONCE,
    BY_CHANCE,
    IN_THE_END,
    SHARE,
    SHOWN,
    UNSURE,
    WHOLE,
    depth_of,
    hidden_variance,
    never_seen,
    remember,
    whole_one,
)
from tracker.image.newton import FIT_SIZE, SHARES, gauss_newton
from tracker.image.patch import Expected, cut, extent_of
from tracker.types import Array, Image

KNOWN = accustomed(RADIUS_PX)
WHITE_BGR, DARK_BGR = np.full(3, 235.0), np.full(3, 25.0)
DIM = 0.3


def shown(image: Image, what: Expected) -> Array:
    """Return what one look shows of a ball (SHOWN,)."""
    extent, fit = extent_of(what), np.empty(FIT_SIZE)
    patch, (luma, chroma) = cut(image, extent, what), templates_of(what)
    gauss_newton(patch.bright, patch.colour, *luma, *chroma, numbers_of(what), extent.du, extent.dv, fit)
    return fit[SHARES:]


def picture(uv_px: Array, rng: np.random.Generator, gain: float = 1.0, rod: Array | None = None) -> Image:
    """Take a picture of a ball in so much light; a rod of that colour, 3 px wide, hides all beyond its middle."""
    canvas = empty_canvas(CAMERA)
    draw_ball(canvas, uv_px, RADIUS_PX, BALL)
    if rod is not None:
        draw_band(canvas, uv_px, rng.uniform(0.0, 2.0 * np.pi), 1.5, 1.5, rod)
    return developed(gain * canvas, (1.0, rng))


def what_at(uv_px: Array, known: Appearance = KNOWN) -> Expected:
    return known.expected_like(expected(uv_px), CAMERA, uv_px)


def test_the_depth_of_an_edge_hides_the_share_it_is_told() -> None:
    y, x = np.mgrid[-1.0:1.0:2001j, -1.0:1.0:2001j]
    disc = x * x + y * y < 1.0
    for hidden in (0.02, 0.1, 0.3, 0.5, 0.7, 0.95):
        assert np.mean(x[disc] > 1.0 - depth_of(hidden)) == pytest.approx(hidden, abs=2e-3)


@pytest.mark.parametrize("gain", [1.0, DIM], ids=["as learned", "dim"])
def test_a_whole_ball_is_whole_in_any_light_and_never_doubted(gain: float) -> None:
    rng, shares = np.random.default_rng(1), []
    for _ in range(100):
        uv_px = rng.uniform((200, 200), (400, 300))
        seen, what = shown(picture(uv_px, rng, gain), what_at(uv_px)), what_at(uv_px)
        assert hidden_variance(seen, AT_ONCE, WHOLE, numbers_of(what)) == 0.0
        shares.append(seen[SHARE])
    assert np.mean(shares) > 0.97


def test_a_whole_ball_through_jpeg_is_hardly_ever_doubted() -> None:
    rng, doubted = np.random.default_rng(2), 0
    known = replace(KNOWN, response=replace(KNOWN.response, chroma_px=0.7, detail=0.0))
    for _ in range(100):
        uv_px = rng.uniform((200, 200), (400, 300))
        what = what_at(uv_px, known)
        seen = shown(through_jpeg(picture(uv_px, rng), 60), what)
        doubted += hidden_variance(seen, AT_ONCE, WHOLE, numbers_of(what)) > 0.0
    assert doubted <= 2


@pytest.mark.parametrize("gain", [1.0, DIM], ids=["as learned", "dim"])
@pytest.mark.parametrize("rod", [WHITE_BGR, DARK_BGR], ids=["white", "dark"])
def test_half_a_ball_is_about_half_of_one(rod: Array, gain: float) -> None:
    rng, shares = np.random.default_rng(3), []
    for _ in range(100):
        uv_px = rng.uniform((200, 200), (400, 300))
        shares.append(shown(picture(uv_px, rng, gain, rod), what_at(uv_px))[SHARE])
    assert 0.4 < np.mean(shares) < 0.7


@pytest.mark.parametrize("rod", [WHITE_BGR, DARK_BGR], ids=["white", "dark"])
def test_the_centre_of_a_half_hidden_ball_is_within_five_sigma(rod: Array) -> None:
    """28.7 is chi-square's for two errors."""
    rng, found_count = np.random.default_rng(4), 0
    for _ in range(100):
        uv_px = rng.uniform((200, 200), (400, 300))
        found = fit_centre(picture(uv_px, rng, rod=rod), what_at(uv_px))
        if isinstance(found, Centre):
            found_count += 1
            error = found.uv_px - uv_px
            assert error @ np.linalg.solve(found.cov_px, error) < 28.7
    assert found_count > 50


def test_looks_that_each_may_be_chance_are_not_all_of_them() -> None:
    """A share of 0.8, unsure by 0.16, is not doubted by itself; twenty times in a row it is."""
    one, ball = np.empty(SHOWN), numbers_of(what_at(np.array((300.0, 250.0))))
    one[SHARE], one[BY_CHANCE], one[UNSURE] = 0.8, 0.15**2, 0.05**2
    assert hidden_variance(one, IN_THE_END, WHOLE, ball) == 0.0
    lately = never_seen(1)
    for _ in range(20):
        remember(one[None], lately)
    assert hidden_variance(lately[0], IN_THE_END, WHOLE, ball) > 0.0
    assert lately[0, SHARE] == pytest.approx(0.8)


def test_a_ball_not_found_teaches_nothing_and_one_no_longer_hidden_is_soon_believed_again() -> None:
    half, ball = np.array(((0.5, 0.05**2, 0.05**2),)), numbers_of(what_at(np.array((300.0, 250.0))))
    lately = never_seen(1)
    remember(half, lately)
    before = lately.copy()
    remember(np.full((1, SHOWN), np.nan), lately)
    assert np.array_equal(lately, before)
    for _ in range(30):
        remember(np.array(((1.0, 0.05**2, 0.05**2),)), lately)
    assert hidden_variance(lately[0], IN_THE_END, WHOLE, ball) == 0.0


def test_what_all_balls_of_a_camera_lack_is_not_hidden_unless_it_is_much() -> None:
    lately = never_seen(3)
    assert whole_one(lately) == WHOLE
    remember(np.array(((0.9, 0.0, 0.1), (0.91, 0.0, 0.1), (0.5, 0.0, 0.1))), lately)
    assert whole_one(lately) == pytest.approx(0.91)
    for _ in range(10):
        remember(np.full((3, SHOWN), 0.5), lately)
    assert 0.8 < whole_one(lately) < 0.9


def test_a_ball_in_light_not_known_may_be_lit_from_the_side_as_well_as_hidden() -> None:
    rng, uv_px = np.random.default_rng(5), np.array((300.3, 250.4))
    seen = shown(picture(uv_px, rng, rod=DARK_BGR), expected(uv_px))
    assert np.isnan(seen[SHARE])
    assert hidden_variance(seen, AT_ONCE, WHOLE, numbers_of(expected(uv_px))) == 0.0
