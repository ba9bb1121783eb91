"""Balls too bright for their camera: where they are is still told, or how little is known of it."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tracker.drawing import developed, draw_ball, empty_canvas
from tests.tracker.image.test_centre import BALL, CAMERA, RADIUS_PX, accustomed, expected
from tracker.image.centre import Centre, fit_centre
from tracker.image.exposure import CLIPPED, LUMA_WEIGHTS, channel_weights, overexposed
from tracker.types import Array, Image

AT_PX = 20.0
DULL, FULL = 80, 255


def disc(bgr: tuple[int, int, int]) -> Image:
    """Paint a disc of one colour on a dull wall."""
    image = np.full((41, 41, 3), DULL, np.uint8)
    v, u = np.mgrid[:41, :41]
    image[np.hypot(u - AT_PX, v - AT_PX) < RADIUS_PX + 1.0] = bgr
    return image


def bright(uv_px: Array, gain: float, rng: np.random.Generator) -> Image:
    """Take a picture of a ball with so much more light, cut off where the camera is full."""
    canvas = empty_canvas(CAMERA)
    draw_ball(canvas, uv_px, RADIUS_PX, BALL)
    return developed(gain * canvas, (1.0, rng))


def test_a_channel_that_a_ball_fills_does_not_count_in_its_brightness() -> None:
    blue, green, red = channel_weights(disc((DULL, DULL, FULL)), AT_PX, AT_PX, RADIUS_PX)
    assert red == 0.0
    assert blue + green == pytest.approx(1.0)
    assert green / blue == pytest.approx(LUMA_WEIGHTS[1] / LUMA_WEIGHTS[0])


@pytest.mark.parametrize("level", [CLIPPED - 1, FULL])
def test_all_channels_count_where_a_ball_fills_none_or_all(level: int) -> None:
    weights = channel_weights(disc((level, level, level)), AT_PX, AT_PX, RADIUS_PX)
    assert weights == LUMA_WEIGHTS


def test_a_ball_teaches_unless_much_of_it_is_full_in_any_channel() -> None:
    assert not overexposed(disc((DULL, CLIPPED - 1, DULL)), AT_PX, AT_PX, RADIUS_PX)
    assert overexposed(disc((DULL, FULL, DULL)), AT_PX, AT_PX, RADIUS_PX)


@pytest.mark.parametrize("gain", [1.7, 2.4, 3.2])
def test_a_ball_too_bright_is_no_further_off_than_its_fit_says(gain: float) -> None:
    """Of forty fits in light that is known the mean squared error over its covariance is 2 in a plain picture."""
    rng, known, squares = np.random.default_rng(5), accustomed(RADIUS_PX), []
    for _ in range(40):
        uv_px = rng.uniform((200, 200), (400, 300))
        start_px = uv_px + rng.uniform(-0.5, 0.5, 2)
        found = fit_centre(bright(uv_px, gain, rng), known.expected_like(expected(uv_px), CAMERA, start_px))
        assert isinstance(found, Centre)
        error_px = found.uv_px - uv_px
        squares.append(float(error_px @ np.linalg.solve(found.cov_px, error_px)))
    assert np.mean(squares) < 4.0
