"""Templates: what one can stand in for, and when a new one is drawn."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tracker.paper_rig import paper_rig
from tracker.image.album import Album
from tracker.image.appearance import MANY, Appearance
from tracker.image.light import Light
from tracker.image.newton import draw_at, rows_of
from tracker.image.patch import Response
from tracker.image.reading import BALL_SIZE, LUMA_VAR, RADIUS
from tracker.image.template import BLUR_STEP_PX, FLAT, RADIUS_STEP_PX, Template, template_for, variance_of
from tracker.image.view import RADIUS as VIEW_RADIUS
from tracker.image.view import RAY_X
from tracker.types import Array

CAMERA = paper_rig().cameras[0]
KNOWN = Appearance(Response(0.4, 0.7))


def view(radius_px: float) -> list[float]:
    row = [0.0] * (VIEW_RADIUS + 1)
    row[VIEW_RADIUS], row[RAY_X] = radius_px, 0.01
    return row


def shown(template: Template, radius_px: float, blur_px: float, at: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Return what a template shows of a ball on a patch, its shapes (4, n)."""
    x, y = np.meshgrid(np.arange(-9.0, 10.0), np.arange(-9.0, 10.0))
    pixels = np.stack((x.ravel(), y.ravel(), np.ones(x.size), np.ones(x.size)))
    ball, drawn = np.zeros(BALL_SIZE), np.empty((rows_of(4), x.size))
    ball[RADIUS], ball[LUMA_VAR] = radius_px, variance_of(blur_px, 1)
    draw_at(pixels, template.fine, template.made, ball, LUMA_VAR, *at, drawn)
    return drawn[:4]


@pytest.mark.parametrize("radius_px", [2.8, 4.4, 8.2])
@pytest.mark.parametrize(("radius_steps", "blur_steps"), [(1, 0), (-1, 0), (0, 1), (0, -1)])
def test_a_neighbour_shows_a_ball_as_its_own_template_does(
    radius_px: float, radius_steps: int, blur_steps: int
) -> None:
    """Within 2 % of the contrast a whole step away; not put right, it would be 4 to 16 % off."""
    blur_px = 0.4
    neighbour = template_for(radius_px + radius_steps * RADIUS_STEP_PX, blur_px + blur_steps * BLUR_STEP_PX, FLAT)
    own = template_for(radius_px, blur_px, FLAT)
    assert np.abs(shown(neighbour, radius_px, blur_px) - shown(own, radius_px, blur_px)).max() < 0.02


def test_a_ball_between_the_points_of_the_grid_is_where_it_is_said_to_be() -> None:
    own, place = template_for(4.4, 0.4, FLAT), (0.047, -0.031)
    coverage = shown(own, 4.4, 0.4, place)[0]
    x, y = np.meshgrid(np.arange(-9.0, 10.0), np.arange(-9.0, 10.0))
    middle = (coverage @ x.ravel()) / coverage.sum(), (coverage @ y.ravel()) / coverage.sum()
    assert np.allclose(middle, place, atol=0.001)


def test_every_template_is_drawn_while_nothing_else_is_said() -> None:
    album = Album(CAMERA)
    for radius_px in (3.0, 3.2, 3.4):
        luma, chroma = album.serve(0, view(radius_px), KNOWN)
        assert luma.made[1] == pytest.approx(radius_px)
        assert chroma.made[1] == pytest.approx(radius_px)


def test_a_flight_under_way_draws_as_many_as_it_may_and_the_neighbour_serves_meanwhile() -> None:
    album = Album(CAMERA)
    first = album.serve(0, view(3.0), KNOWN)
    album.draws_left = 1
    luma, chroma = album.serve(0, view(3.2), KNOWN)
    assert (luma.made[1], chroma) == (pytest.approx(3.2), first[1])
    album.draws_left = 1
    assert album.serve(0, view(3.2), KNOWN)[1].made[1] == pytest.approx(3.2)


def test_a_template_too_far_off_never_serves() -> None:
    """Two steps of radius, or one and a step of blur."""
    album, blurred = Album(CAMERA), Appearance(Response(0.5, 0.8))
    album.serve(0, view(3.0), KNOWN)
    album.draws_left = 0
    assert album.serve(0, view(3.4), KNOWN)[0].made[1] == pytest.approx(3.4)
    assert album.serve(0, view(3.6), blurred)[0].made[1] == pytest.approx(3.6)


def test_what_was_drawn_once_serves_again_without_drawing() -> None:
    album = Album(CAMERA)
    first, _ = album.serve(0, view(3.0), KNOWN)
    album.serve(0, view(3.2), KNOWN)
    album.draws_left = 0
    assert album.serve(0, view(3.0), KNOWN)[0] is first


def seen_as(blur_px: float, balls: int) -> Appearance:
    light = Light(count=balls)
    return Appearance(Response(blur_px, 0.7), light, light)


def test_a_blur_that_lessons_move_to_and_fro_keeps_its_template_and_one_that_goes_on_gets_another() -> None:
    album = Album(CAMERA)
    first, _ = album.serve(0, view(3.0), seen_as(0.4, MANY + 1))
    for blur_px in (0.46, 0.34, 0.475):
        assert album.serve(0, view(3.0), seen_as(blur_px, MANY + 1))[0].made[2] == first.made[2]
    another, _ = album.serve(0, view(3.0), seen_as(0.49, MANY + 1))
    assert another.made[2] == pytest.approx(variance_of(0.5, 1))


def test_a_blur_learned_from_few_balls_is_followed_by_the_nearest_step() -> None:
    album = Album(CAMERA)
    album.serve(0, view(3.0), seen_as(0.4, MANY))
    followed, _ = album.serve(0, view(3.0), seen_as(0.46, MANY))
    assert followed.made[2] == pytest.approx(variance_of(0.5, 1))
