"""What is fixed to a ball is told from what stands behind it, by looking from many sides."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.drawing import developed, draw_ball, draw_band, empty_canvas
from tests.tracker.paper_rig import paper_rig
from tests.tracker.rigs import state
from tracker.filter.measure import camera_table
from tracker.image.appearance import Appearance
from tracker.image.centre import Centre, fit_centre
from tracker.image.holder import ALONG_U, ALONG_V, EXCESS, HALF_WIDTH, distrust
from tracker.image.mounting import ENOUGH, STRANGE, Mounting, things_seen
from tracker.image.patch import TRUST, Expected, Response, X, Y
from tracker.image.template import FLAT
from tracker.image.view import expected_views
from tracker.maths import so3
from tracker.types import Array

RIG = paper_rig()
CAMERA, BALL, RADIUS_PX = RIG.cameras[0], RIG.marker.balls[1], 5.0
TUBE_BGR = np.array((40.0, 38.0, 36.0))
VIEWS = 80
ALONG_inB = np.array((0.8, 0.0, -0.6))
SHARP = Response(0.2, 0.2, detail=1.0)

Draw = Callable[[Array, Array, Array], None]
"""Put something on a canvas, about a ball's centre uv_px (2,), at an attitude R_BtoW (3, 3)."""


def seen_along(uv_px: Array, R_BtoW: Array) -> Array:
    """Return the image direction (2,) in which the tube leads from a ball, by two projected points."""
    ball_inW = CAMERA.p_CinW + 1.3 * CAMERA.R_CtoW @ CAMERA.bearings(uv_px[None])[0]
    ends_px, _ = CAMERA.project(np.stack((ball_inW, ball_inW + 0.001 * R_BtoW @ ALONG_inB)))
    step = ends_px[1] - ends_px[0]
    return np.asarray(step / np.linalg.norm(step))


def draw_tube(canvas: Array, uv_px: Array, R_BtoW: Array) -> None:
    """Draw a dark tube that begins inside the ball's edge."""
    along, banded = seen_along(uv_px, R_BtoW), canvas.copy()
    draw_band(banded, uv_px, math.atan2(along[1], along[0]), 0.0, 0.6, TUBE_BGR)
    v, u = np.mgrid[: canvas.shape[0], : canvas.shape[1]]
    beyond = (u - uv_px[0]) * along[0] + (v - uv_px[1]) * along[1] > 0.8 * RADIUS_PX
    canvas[beyond] = banded[beyond]


def draw_shelves(canvas: Array, uv_px: Array, _R_BtoW: Array) -> None:
    """Draw a dark line past the ball as the room has it there, wherever the vehicle's nose points."""
    draw_band(canvas, uv_px, float(uv_px[0]), RADIUS_PX + 1.0, 0.6, TUBE_BGR)


def draw_nothing(_canvas: Array, _uv_px: Array, _R_BtoW: Array) -> None:
    """Leave the ball alone."""


def after_views(views: int, draw: Draw) -> Mounting:
    """Return what is known of ball 1 after it was seen from so many sides."""
    rng, mounting, known = np.random.default_rng(8), Mounting(RIG.marker), Appearance(SHARP)
    for _ in range(views):
        uv_px = rng.uniform((150, 150), (450, 330))
        R_BtoW = so3.from_euler(rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2), rng.uniform(-math.pi, math.pi))
        canvas = empty_canvas(CAMERA)
        draw_ball(canvas, uv_px, RADIUS_PX, BALL)
        draw(canvas, uv_px, R_BtoW)
        image = developed(canvas, (1.5, rng))
        x, y, z = CAMERA.bearings(uv_px[None])[0].tolist()
        ball = Expected((float(uv_px[0]), float(uv_px[1])), RADIUS_PX, (0.0, 0.0), FLAT, SHARP, ray=(x / z, y / z))
        ball = known.expected_like(ball, CAMERA, uv_px)
        found = fit_centre(image, ball)
        assert isinstance(found, Centre)
        known = known.learned(image, CAMERA, ball, found)
        mounting.learn(image, ball, 1, found, CAMERA.R_CtoW.T @ R_BtoW)
    return mounting


def test_a_tube_that_holds_a_ball_is_found_in_the_body() -> None:
    things = after_views(VIEWS, draw_tube).things
    assert things[1, 0, :3] @ ALONG_inB > math.cos(math.radians(20.0))
    assert things[1, 0, STRANGE] > 1.0
    assert not things[[0, 2]].any()


@pytest.mark.parametrize("draw", [draw_nothing, draw_shelves])
def test_neither_a_bare_ball_nor_one_before_shelves_is_held_by_anything(draw: Draw) -> None:
    assert not after_views(VIEWS, draw).things.any()


def test_few_views_tell_nothing() -> None:
    assert not after_views(ENOUGH // 2, draw_tube).things.any()


def test_a_thing_is_expected_where_the_camera_sees_it_lead() -> None:
    flying = state(0, (0.1, -0.1, 0.1), (5.0, -10.0, 70.0))
    views, things = expected_views(flying, RIG, 0, 0), np.zeros((3, 3, 4))
    things[1, 0] = *ALONG_inB, 5.0
    seen = things_seen(flying.mean, camera_table(RIG)[0], views, things)
    assert np.allclose(seen[1, 0, :EXCESS], seen_along(views[1, :2], flying.R_BtoW), atol=0.02)
    assert seen[1, 0, EXCESS] == 5.0
    assert not seen[[0, 2]].any()
    assert not seen[1, 1:].any()


def test_a_thing_seen_from_its_end_is_not_looked_for() -> None:
    flying = state(0, (0.1, -0.1, 0.1), (5.0, -10.0, 70.0))
    views, things = expected_views(flying, RIG, 0, 0), np.zeros((3, 3, 4))
    towards = CAMERA.R_CtoW @ CAMERA.bearings(views[1:2, :2])[0]
    things[1, 0] = *(flying.R_BtoW.T @ towards), 5.0
    assert not things_seen(flying.mean, camera_table(RIG)[0], views, things)[1, 0, EXCESS]


def test_pixels_along_a_thing_are_trusted_less_and_smear_across_it_thins_that_out() -> None:
    pixels = np.zeros((5, 3))
    pixels[X], pixels[Y] = (4.0, -4.0, 4.0), (0.0, 0.0, 3.0)  # along it, on the other side, aside
    held = np.zeros((1, 3))
    held[0, [ALONG_U, ALONG_V, EXCESS]] = 1.0, 0.0, 8.0
    trusts = []
    for streak_v in (0.0, 2.0 * HALF_WIDTH * RADIUS_PX):
        pixels[TRUST] = 1.0
        distrust(pixels, held, RADIUS_PX, 0.0, streak_v, 0.0, 0.0)
        trusts.append(pixels[TRUST].copy())
    assert trusts[0] == pytest.approx([1.0 / 3.0, 1.0, 1.0])
    assert trusts[1] == pytest.approx([1.0 / math.sqrt(3.0), 1.0, 1.0 / math.sqrt(3.0)])


def test_a_ball_whose_ray_is_not_known_cannot_teach() -> None:
    canvas = empty_canvas(CAMERA)
    draw_ball(canvas, np.array((300.0, 240.0)), RADIUS_PX, BALL)
    image, ball = developed(canvas), Expected((300.0, 240.0), RADIUS_PX, (0.0, 0.0), FLAT, SHARP)
    found = fit_centre(image, ball)
    assert isinstance(found, Centre)
    with pytest.raises(ValueError, match="ray"):
        Mounting(RIG.marker).learn(image, replace(ball, ray=None), 1, found, np.eye(3))
