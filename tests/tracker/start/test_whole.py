"""What a track may start on, before things of a ball's own colour and elsewhere."""

from __future__ import annotations

from unittest.mock import Mock

import numpy as np
import pytest

from tests.tracker.drawing import developed, draw_ball, empty_canvas
from tests.tracker.paper_rig import paper_rig
from tracker.image.behind import KNOWN, NO_ROOM, TILE_PX, Room
from tracker.image.look import look_everywhere
from tracker.image.tint import NEUTRAL
from tracker.start.whole import Whole, look_through, to_start_on
from tracker.types import Array, Frame

RIG = paper_rig()
CAMERA, ORANGE = RIG.cameras[0], RIG.marker.balls[2]
PLACE = np.array([300.3, 240.4])
WOOD_BGR = np.array([52.0, 94.0, 158.0])


def shelf() -> Array:
    """Return a wall with a board of the orange ball's colour, and a small block of it elsewhere."""
    canvas = empty_canvas(CAMERA)
    canvas[200:320, 200:420] = WOOD_BGR
    canvas[100:106, 500:506] = WOOD_BGR
    return canvas


def whole(canvas: Array, known: Array | None) -> Whole:
    """Look through a picture of a ball before a canvas, of which the room is what is known."""
    image = canvas.copy()
    draw_ball(image, PLACE, 3.0, ORANGE)
    room = NO_ROOM
    if known is not None:
        tiles = canvas.shape[0] // TILE_PX, canvas.shape[1] // TILE_PX
        room = Room(known.astype(np.float32), np.full(tiles, KNOWN, np.uint8))
    return look_through(Frame(0, 0, developed(image)), CAMERA, RIG, NEUTRAL, room)


def test_the_ball_alone_is_tried_first_and_then_what_else_has_its_colour() -> None:
    first, second = to_start_on([whole(shelf(), shelf())])
    (ball,) = first[0][1][2]
    assert np.abs(ball.uv_px - PLACE).max() < 0.8
    (block,) = second[0][1][2]  # the board is too large for a ball, and the ball is part of it
    assert np.abs(block.uv_px - (502.5, 102.5)).max() < 0.5


def test_a_room_without_the_colour_is_tried_once() -> None:
    assert len(list(to_start_on([whole(empty_canvas(CAMERA), empty_canvas(CAMERA))]))) == 1


def test_an_unknown_room_is_tried_once() -> None:
    (only,) = to_start_on([whole(shelf(), None)])
    assert [len(blobs) for blobs in only[0][1]] == [0, 0, 1]


def test_who_starts_on_the_ball_alone_does_not_wait_for_what_else_has_its_colour(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    look = Mock(wraps=look_everywhere)
    monkeypatch.setattr("tracker.start.whole.look_everywhere", look)
    attempts = to_start_on([whole(shelf(), shelf())])
    next(attempts)
    assert look.call_count == 1
    next(attempts)
    assert look.call_count == 2
