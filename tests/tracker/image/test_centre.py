"""The centre of one ball to a fraction of a pixel, on balls drawn by other means."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.drawing import developed, draw_ball, draw_band, empty_canvas, through_jpeg
from tests.tracker.paper_rig import paper_rig
from tracker.image.appearance import Appearance
from tracker.image.centre import Centre, fit_centre
from tracker.image.holder import held_towards
from tracker.image.patch import NOT_HELD, Expected, Response
from tracker.image.template import FLAT
from tracker.types import Array, Image, Reason

RIG = paper_rig()
CAMERA = RIG.cameras[0]
BALL = RIG.marker.balls[1]
RADIUS_PX = 2.8  # the paper's ball in the middle of the room
SHARP = Response(0.2, 0.2, detail=1.0)
Noise = tuple[float, np.random.Generator] | None
TUBE_BGR, SKIN_BGR = np.array([38.0, 36.0, 35.0]), np.array([118.0, 142.0, 198.0])


def expected(uv_px: Array, radius_px: float = RADIUS_PX) -> Expected:
    return Expected((float(uv_px[0]), float(uv_px[1])), radius_px, (0.0, 0.0), FLAT, SHARP)


Paint = Callable[[Array, float, Noise], Image]


def picture(uv_px: Array, radius_px: float = RADIUS_PX, noise: Noise = None) -> Image:
    canvas = empty_canvas(RIG.cameras[0])
    draw_ball(canvas, uv_px, radius_px, BALL)
    return developed(canvas, noise)


def fitted(image: Image, guess_px: Array, radius_px: float = RADIUS_PX) -> Centre:
    found = fit_centre(image, expected(guess_px, radius_px))
    assert isinstance(found, Centre), found
    return found


def accustomed(radius_px: float, paint: Paint = picture) -> Appearance:
    """Return what a camera has learned from forty balls."""
    rng = np.random.default_rng(2)
    known = Appearance(SHARP)
    for _ in range(40):
        uv_px = rng.uniform((200, 200), (400, 300))
        image = paint(uv_px, radius_px, (1.0, rng))
        what = known.expected_like(expected(uv_px, radius_px), CAMERA, uv_px)
        found = fit_centre(image, what)
        assert isinstance(found, Centre)
        known = known.learned(image, CAMERA, what, found)
    return known


@pytest.mark.parametrize("radius_px", [2.2, 2.8, 4.0, 6.5])
def test_a_ball_is_found_to_a_fortieth_of_a_pixel_once_the_light_is_known(radius_px: float) -> None:
    """Root mean square on each axis, at noise of one grey level, however rough the start."""
    rng, known = np.random.default_rng(3), accustomed(radius_px)
    errors = []
    for _ in range(12):
        uv_px = rng.uniform((200, 200), (400, 300))
        start_px = uv_px + rng.uniform(-0.7, 0.7, 2)
        what = known.expected_like(expected(uv_px, radius_px), CAMERA, start_px)
        found = fit_centre(picture(uv_px, radius_px, noise=(1.0, rng)), what)
        assert isinstance(found, Centre)
        errors.append(found.uv_px - uv_px)
    assert np.sqrt(np.mean(np.square(errors), axis=0)).max() < 1.0 / 40.0


def on_a_stand(uv_px: Array, radius_px: float, noise: Noise) -> Image:
    """Take a picture of a ball that rests on a dark bar."""
    canvas = empty_canvas(CAMERA)
    draw_ball(canvas, uv_px, radius_px, BALL)
    draw_band(canvas, uv_px, 0.0, -radius_px, 0.5, TUBE_BGR)
    return developed(canvas, noise)


def test_a_bar_under_every_ball_is_not_taken_for_shade() -> None:
    rng, known = np.random.default_rng(3), accustomed(4.0, on_a_stand)
    errors = []
    for _ in range(20):
        uv_px = rng.uniform((200, 200), (400, 300))
        found = fit_centre(picture(uv_px, 4.0, (1.0, rng)), known.expected_like(expected(uv_px, 4.0), CAMERA, uv_px))
        assert isinstance(found, Centre)
        errors.append(found.uv_px - uv_px)
    assert np.abs(np.mean(errors, axis=0)).max() < 0.02


def on_a_tube(uv_px: Array, radius_px: float, noise: Noise) -> Image:
    """Take a picture, through JPEG, of a ball with a dark tube that comes from the left."""
    canvas = empty_canvas(CAMERA)
    draw_ball(canvas, uv_px, radius_px, BALL)
    draw_band(canvas[:, : round(float(uv_px[0]) - 0.8 * radius_px)], uv_px, 0.0, 0.0, 0.4, TUBE_BGR)
    return through_jpeg(developed(canvas, noise))


def test_a_ball_that_a_tube_holds_is_found_more_surely_with_the_tube_left_out() -> None:
    rng, known = np.random.default_rng(3), accustomed(RADIUS_PX)
    drawn_px: list[float] = []
    left_out_px: list[float] = []
    for _ in range(200):
        u, v = rng.uniform((200, 200), (400, 300))
        image = on_a_tube(np.array((u, v)), RADIUS_PX, (2.0, rng))
        what = known.expected_like(expected(np.array((u, v))), CAMERA, np.array((u, v)))
        for errors, held in ((drawn_px, NOT_HELD), (left_out_px, held_towards((u, v), (u - 60.0, v), RADIUS_PX))):
            found = fit_centre(image, replace(what, held=held))
            assert isinstance(found, Centre)
            errors.append(float(found.uv_px[0]) - u)
    assert np.std(left_out_px) < 0.8 * np.std(drawn_px)
    assert abs(np.mean(left_out_px)) < 3.0 * np.std(left_out_px) / np.sqrt(len(left_out_px))


@pytest.mark.parametrize("radius_px", [2.2, 2.8, 4.0, 6.5])
def test_a_ball_in_light_not_known_is_found_to_a_twentieth_of_its_radius(radius_px: float) -> None:
    rng = np.random.default_rng(3)
    for _ in range(6):
        uv_px = rng.uniform((200, 200), (400, 300))
        found = fitted(picture(uv_px, radius_px), uv_px + rng.uniform(-0.7, 0.7, 2), radius_px)
        assert np.hypot(*(found.uv_px - uv_px)) < 0.05 * radius_px


def test_the_mean_error_over_many_places_is_small_though_the_light_is_not_known() -> None:
    rng = np.random.default_rng(4)
    errors = []
    for _ in range(30):
        uv_px = rng.uniform((200, 200), (400, 300))
        errors.append(fitted(picture(uv_px, noise=(2.0, rng)), uv_px + rng.uniform(-0.5, 0.5, 2)).uv_px - uv_px)
    assert np.abs(np.mean(errors, axis=0)).max() < 0.06
    assert np.std(errors, axis=0).max() < 0.04


def test_the_covariance_is_one_and_grows_with_the_noise_once_the_light_is_known() -> None:
    """Before, what light there may be leaves more to doubt than noise does."""
    rng = np.random.default_rng(5)
    uv_px = np.array([300.4, 200.2])
    what, sigmas = accustomed(RADIUS_PX).expected_like(expected(uv_px), CAMERA, uv_px), []
    for level in (0.5, 4.0, 12.0):
        found = fit_centre(picture(uv_px, noise=(level, rng)), what)
        assert isinstance(found, Centre)
        assert np.allclose(found.cov_px, found.cov_px.T)
        assert np.linalg.eigvalsh(found.cov_px).min() > 0.0
        sigmas.append(float(np.sqrt(np.trace(found.cov_px))))
    assert sigmas == sorted(sigmas)
    assert sigmas[-1] > 2.0 * sigmas[0]


def test_errors_are_of_the_size_that_the_covariance_says() -> None:
    """Mean NEES of a 2-D error is 2; within a factor of three, as the drawn ball is not quite the modelled one."""
    rng = np.random.default_rng(6)
    nees = []
    for _ in range(40):
        uv_px = rng.uniform((200, 200), (400, 300))
        found = fitted(picture(uv_px, noise=(5.0, rng)), uv_px)
        error = found.uv_px - uv_px
        nees.append(error @ np.linalg.solve(found.cov_px, error))
    assert 2.0 / 3.0 < np.mean(nees) < 6.0


@pytest.mark.parametrize(
    ("half_px", "bgr", "beyond"), [(0.7, TUBE_BGR, 0.0), (8.0, SKIN_BGR, 0.01)], ids=["tube", "hand"]
)
def test_a_ball_partly_hidden_is_within_five_sigma(half_px: float, bgr: Array, beyond: float) -> None:
    """All behind a tube, and all but one in a hundred behind a hand, whose edge a ball's own may be taken for.

    Beside 0.02 px, which a camera's noise is never less than; 28.7 is chi-square's for two errors.
    """
    rng, known = np.random.default_rng(7), accustomed(RADIUS_PX)
    squares = []
    for _ in range(300):
        uv_px = rng.uniform((200, 200), (400, 300))
        canvas = empty_canvas(CAMERA)
        draw_ball(canvas, uv_px, RADIUS_PX, BALL)
        turn_rad, cut_px = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(-0.8, 0.8) * RADIUS_PX
        aside_px = cut_px if half_px < RADIUS_PX else half_px + abs(cut_px)
        draw_band(canvas, uv_px, turn_rad, aside_px, half_px, bgr)
        found = fit_centre(developed(canvas, (1.0, rng)), known.expected_like(expected(uv_px), CAMERA, uv_px))
        if isinstance(found, Centre):
            error = found.uv_px - uv_px
            squares.append(error @ np.linalg.solve(found.cov_px + 0.02**2 * np.eye(2), error))
    assert len(squares) > 100
    assert np.mean(np.array(squares) > 28.7) <= beyond


def test_a_ball_that_drowns_in_noise_is_within_five_sigma_or_none() -> None:
    """28.7 is chi-square's for two errors."""
    rng, known, drowned = np.random.default_rng(8), accustomed(RADIUS_PX), 0
    for level in np.repeat([15.0, 30.0, 60.0, 120.0], 20):
        uv_px = rng.uniform((200, 200), (400, 300))
        found = fit_centre(picture(uv_px, noise=(level, rng)), known.expected_like(expected(uv_px), CAMERA, uv_px))
        if isinstance(found, Centre):
            error = found.uv_px - uv_px
            assert error @ np.linalg.solve(found.cov_px, error) < 28.7
        drowned += found is Reason.NO_BALL
    assert 20 <= drowned <= 60


@pytest.mark.parametrize("uv_px", [(1.0, 200.0), (200.0, 2.0), (638.5, 200.0), (200.0, 478.0), (-5.0, -5.0)])
def test_a_ball_cut_by_the_border_is_rejected(uv_px: tuple[float, float]) -> None:
    assert fit_centre(picture(np.array(uv_px)), expected(np.array(uv_px))) is Reason.AT_BORDER


def test_an_image_that_nobody_may_write_to_can_be_fitted() -> None:
    uv_px = np.array([300.4, 200.2])
    image = picture(uv_px)
    writeable = fitted(image, uv_px)
    image.flags.writeable = False
    assert np.array_equal(fitted(image, uv_px).uv_px, writeable.uv_px)


@pytest.mark.parametrize(("radius_px", "off_px", "found"), [(9.0, 2.2, True), (9.0, 4.0, False), (2.8, 2.2, False)])
def test_a_large_ball_may_be_further_from_its_spots_middle_than_a_small_one(
    radius_px: float, off_px: float, found: bool
) -> None:
    """Of a large ball the dark side may show no colour."""
    uv_px = np.array([300.3, 240.4])
    centre = fit_centre(picture(uv_px, radius_px), expected(uv_px + np.array([off_px, 0.0]), radius_px))
    assert isinstance(centre, Centre) is found
    if isinstance(centre, Centre):
        assert np.abs(centre.uv_px - uv_px).max() < 0.3
