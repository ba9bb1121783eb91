"""The spot that is taken for a ball, before things of its own colour."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.tracker.drawing import developed, draw_ball, draw_band, empty_canvas
from tests.tracker.paper_rig import paper_rig
from tracker.image.behind import KNOWN, NO_ROOM, TILE_PX, Room
from tracker.image.colour_table import colours_of_each
from tracker.image.nearest import nearest_spot
from tracker.image.tint import NEUTRAL
from tracker.image.view import RADIUS, S_UU, S_VV, U, V
from tracker.types import Array, Image

RIG = paper_rig()
CAMERA, ORANGE = RIG.cameras[0], RIG.marker.balls[2]
PLACE = np.array([300.3, 240.4])
WOOD_BGR = np.array([52.0, 94.0, 158.0])
TUBE_BGR = np.array([40.0, 42.0, 44.0])
RADIUS_PX = 3.0
REGION = (270, 210, 331, 271)


def wooden() -> Array:
    """Return boards with grain of the orange ball's colour, as one camera sees them without noise."""
    rng = np.random.default_rng(5)
    grain = 1.0 + 0.1 * rng.standard_normal((CAMERA.height_px, 1, 1))
    return np.asarray(np.broadcast_to(WOOD_BGR, empty_canvas(CAMERA).shape) * grain)


def room_of(canvas: Array, looks: int = KNOWN) -> Room:
    """Return a room that is known to look so."""
    rows, columns = canvas.shape[0] // TILE_PX, canvas.shape[1] // TILE_PX
    return Room(np.ascontiguousarray(canvas, dtype=np.float32), np.full((rows, columns), looks, np.uint8))


def picture(canvas: Array, seed: int = 0, place: Array = PLACE) -> Image:
    """Return a noisy picture of the orange ball before a canvas, which is left as it is."""
    canvas = canvas.copy()
    draw_ball(canvas, place, RADIUS_PX, ORANGE)
    return developed(canvas, (2.0, np.random.default_rng(seed)))


def nearest(image: Image, room: Room, sigma_px: float = 5.0) -> Array:
    """Return where the orange ball is taken to be, expected about its place."""
    view = np.zeros(11)
    view[[U, V, S_UU, S_VV, RADIUS]] = 302.0, 239.0, sigma_px**2, sigma_px**2, RADIUS_PX
    (colours,) = colours_of_each((ORANGE,), NEUTRAL.undoing)
    table = colours.least_spread, colours.lowest_spread, colours.hues, colours.blue, colours.red
    u, v = nearest_spot(image, *room, table, REGION, view)
    return np.array((u, v))


@pytest.mark.parametrize("seed", range(5))
def test_a_ball_before_wood_of_its_colour_is_a_spot_once_the_wood_is_known(seed: int) -> None:
    image = picture(wooden(), seed)
    assert np.isnan(nearest(image, NO_ROOM)).all()
    assert np.abs(nearest(image, room_of(wooden())) - PLACE).max() < 0.8


@pytest.mark.parametrize("turn_rad", [0.3, 1.2, 2.9, 4.4])
def test_a_tube_before_the_wood_draws_it_nowhere(turn_rad: float) -> None:
    """Thin and dark it still has the wood's hue, and is not the wood."""
    canvas = wooden()
    draw_band(canvas, PLACE, turn_rad, 0.0, 0.4, TUBE_BGR)
    away = (np.arange(canvas.shape[1]) - PLACE[0]) * math.cos(turn_rad) + (
        (np.arange(canvas.shape[0])[:, None] - PLACE[1]) * math.sin(turn_rad)
    )
    canvas[away < 0.0] = wooden()[away < 0.0]  # the tube begins in the ball
    assert np.abs(nearest(picture(canvas), room_of(wooden())) - PLACE).max() < 1.3


def test_a_room_without_the_colour_changes_nothing() -> None:
    canvas = empty_canvas(CAMERA)
    image = picture(canvas)
    assert np.array_equal(nearest(image, room_of(canvas)), nearest(image, NO_ROOM))
    assert np.abs(nearest(image, NO_ROOM) - PLACE).max() < 0.7


def test_a_ball_that_was_learned_as_room_is_seen_all_the_same() -> None:
    canvas = empty_canvas(CAMERA)
    with_ball = canvas.copy()
    draw_ball(with_ball, PLACE, RADIUS_PX, ORANGE)
    image = picture(canvas)
    assert np.array_equal(nearest(image, room_of(with_ball)), nearest(image, NO_ROOM))


def test_wood_in_other_light_is_not_what_is_known() -> None:
    """As if nothing were known, then: one spot with the ball."""
    assert np.isnan(nearest(picture(wooden()), room_of(0.6 * wooden()))).all()


def test_where_there_is_no_ball_there_is_none_before_wood() -> None:
    image = developed(wooden(), (2.0, np.random.default_rng(1)))
    assert np.isnan(nearest(image, room_of(wooden()))).all()


@pytest.mark.parametrize("seen_px", [3.0, 3.8, 4.6])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_little_of_its_colour_beside_a_ball_hides_nothing_of_it(seen_px: float, side: float) -> None:
    """However much larger than its disc blur makes it."""
    canvas = empty_canvas(CAMERA)
    row, column = round(PLACE[1]), round(PLACE[0] + side * (seen_px + 1.0))
    canvas[row : row + 2, column] = WOOD_BGR
    with_ball = canvas.copy()
    draw_ball(with_ball, PLACE, seen_px, ORANGE)
    image = developed(with_ball, (2.0, np.random.default_rng(0)))
    assert np.abs(nearest(image, room_of(canvas)) - PLACE).max() < 0.7
