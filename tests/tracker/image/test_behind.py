"""The room behind the balls: learned where the vehicle is not, and only while it stays the same."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tracker.drawing import developed, draw_ball, draw_band, empty_canvas
from tests.tracker.paper_rig import paper_rig
from tests.tracker.rigs import TUNING
from tracker.image.behind import APART_NS, ENOUGH, KNOWN, NO_ROOM, SUPPOSED, TILE_PX, Behind, Room, is_known
from tracker.image.centre import Centre, fit_centre
from tracker.image.patch import Expected, Response
from tracker.image.template import FLAT
from tracker.image.view import whereabouts
from tracker.state import State, mean_of, start_covariance
from tracker.types import Array, Frame, Image

RIG = paper_rig()
CAMERA, BALL = RIG.cameras[0], RIG.marker.balls[1]
FAR_PX = (40.0, 40.0)  # of the vehicle, from what is looked at
PLACE = np.array([300.3, 240.4])
INK_BGR = np.array([40.0, 36.0, 44.0])
RADIUS_PX = 3.0


def written() -> Array:
    """Return a wall with strokes of a pen across the place, as one camera sees it without noise."""
    canvas = empty_canvas(CAMERA)
    for turn_rad, aside_px in ((0.4, 3.0), (1.3, -3.4)):
        draw_band(canvas, PLACE, turn_rad, aside_px, 0.8, INK_BGR)
    return canvas


def looked_at(behind: Behind, canvas: Array, count: int, start_ns: int = 0, clear_px: float = 30.0) -> Behind:
    """Let a camera look at a room, noise and all, so often that every tile may have been seen `count` times."""
    rng = np.random.default_rng(3)
    images = [developed(canvas, (2.0, rng)) for _ in range(15)]
    for k in range(20 * count):
        behind.learn(Frame(0, start_ns + k * (APART_NS // 4), images[k % 15], available_ns=0), FAR_PX, clear_px)
    return behind


def known_at(behind: Behind, place_px: Array) -> bool:
    return is_known(behind.room.looks, int(place_px[0]), int(place_px[1]), 8, KNOWN)


@pytest.fixture(scope="module")
def room() -> Room:
    return looked_at(Behind(CAMERA), written(), ENOUGH - SUPPOSED).room


def test_a_room_looked_at_long_enough_is_known_to_half_its_noise(room: Room) -> None:
    part = np.s_[200:280, 260:340]
    assert np.abs(room.mean[part] - written()[part]).mean() < 0.8  # one image: 1.6


def test_writing_behind_a_ball_that_is_known_moves_its_centre_no_more(room: Room) -> None:
    assert moved_px(room) < 0.4 * moved_px(NO_ROOM)
    assert moved_px(NO_ROOM) > 0.05


def test_a_room_in_half_the_light_still_helps(room: Room) -> None:
    assert moved_px(room, light=0.5) < 0.6 * moved_px(NO_ROOM, light=0.5)


def test_a_room_that_has_changed_does_not_mislead(room: Room) -> None:
    """What was learned does not show round the ball: then it is left out."""
    canvas = empty_canvas(CAMERA)
    draw_ball(canvas, PLACE, RADIUS_PX, BALL)
    image = developed(canvas, (2.0, np.random.default_rng(1)))
    assert fitted(image, room).uv_px == pytest.approx(fitted(image, NO_ROOM).uv_px, abs=0.03)


def moved_px(known: Room, light: float = 1.0) -> float:
    """Return how far writing behind it moves a ball's centre, in the mean of some images."""
    far_px = []
    for seed in range(8):
        centres = []
        for canvas, room in ((written(), known), (empty_canvas(CAMERA), NO_ROOM)):
            draw_ball(canvas, PLACE, RADIUS_PX, BALL)
            image = developed(light * canvas, (1.0, np.random.default_rng(seed)))
            centres.append(fitted(image, room).uv_px)
        far_px.append(float(np.hypot(*(centres[0] - centres[1]))))
    return float(np.mean(far_px))


def fitted(image: Image, room: Room) -> Centre:
    ball = Expected((PLACE[0], PLACE[1]), RADIUS_PX, (0.0, 0.0), FLAT, Response(0.2, 0.2, detail=1.0), room=room)
    found = fit_centre(image, ball)
    assert isinstance(found, Centre), found
    return found


def test_nothing_is_learned_where_the_vehicle_may_be() -> None:
    behind = looked_at(Behind(CAMERA), empty_canvas(CAMERA), KNOWN, clear_px=100.0)
    assert not known_at(behind, np.array(FAR_PX) + 60.0)
    assert known_at(behind, np.array(FAR_PX) + 140.0)


def test_what_stays_but_for_a_moment_is_not_the_room() -> None:
    behind = Behind(CAMERA)
    frames = [Frame(0, k * APART_NS // 20, developed(empty_canvas(CAMERA)), available_ns=0) for k in range(60)]
    for frame in frames[:20]:
        behind.learn(frame, FAR_PX, 30.0)
    assert behind.room.looks.max() < KNOWN


def test_what_stands_elsewhere_now_is_learned_anew() -> None:
    behind = looked_at(Behind(CAMERA), written(), ENOUGH)
    moved = np.roll(written(), TILE_PX // 2, axis=1)
    looked_at(behind, moved, 1, start_ns=10**12)
    row, column = int(PLACE[1]) // TILE_PX, int(PLACE[0]) // TILE_PX
    looked_at(behind, moved, ENOUGH, start_ns=2 * 10**12)
    part = np.s_[TILE_PX * row : TILE_PX * (row + 1), TILE_PX * column : TILE_PX * (column + 1)]
    assert np.abs(behind.room.mean[part] - moved[part]).mean() < 0.8


def test_a_camera_that_has_moved_forgets() -> None:
    behind = looked_at(Behind(CAMERA), written(), KNOWN)
    assert known_at(behind, PLACE)
    behind.forget()
    assert not known_at(behind, PLACE)


def test_the_edge_of_the_picture_is_never_known() -> None:
    behind = looked_at(Behind(CAMERA), empty_canvas(CAMERA), KNOWN)
    assert not known_at(behind, np.array((CAMERA.width_px - 4.0, 200.0)))
    assert not known_at(behind, np.array((300.0, 2.0)))


def test_the_vehicle_is_taken_to_reach_beyond_its_balls() -> None:
    P = start_covariance(TUNING.process, np.zeros(1), 1e-3, 1e-2)
    state = State(0, mean_of(np.zeros(3), np.eye(3)), P)
    u, v, clear_px = whereabouts(state, RIG, 0)
    balls_px = CAMERA.project(RIG.marker.points_inB)[0]
    farthest_px = np.hypot(balls_px[:, 0] - u, balls_px[:, 1] - v).max()
    assert (u, v) == pytest.approx(CAMERA.project(np.zeros((1, 3)))[0][0], abs=1e-6)
    assert 1.5 * farthest_px < clear_px < 8.0 * farthest_px


def test_without_a_track_what_moves_is_not_taken_for_the_room() -> None:
    behind = Behind(CAMERA)
    for k in range(4):
        canvas = written()
        draw_ball(canvas, PLACE + 12.0 * k, RADIUS_PX, BALL)
        behind.suppose(Frame(0, k * APART_NS, developed(canvas), available_ns=0))
    assert not known_at(behind, PLACE)
    assert (behind.room.looks == SUPPOSED).all()
    assert np.abs(behind.room.mean - np.rint(written())).max() < 1.0


def test_what_is_supposed_gives_way_to_the_first_look() -> None:
    behind = Behind(CAMERA)
    behind.suppose(Frame(0, 0, developed(empty_canvas(CAMERA)), available_ns=0))
    looked_at(behind, written(), 1, start_ns=10 * APART_NS, clear_px=0.0)
    part = np.s_[200:280, 260:340]
    looks = behind.room.looks[200 // TILE_PX : 280 // TILE_PX, 260 // TILE_PX : 340 // TILE_PX]
    assert (looks > SUPPOSED).all()
    assert np.abs(behind.room.mean[part] - written()[part]).mean() < 1.7  # one image's noise


def test_what_was_looked_at_is_supposed_no_otherwise() -> None:
    behind = looked_at(Behind(CAMERA), written(), 1)
    before = behind.room.mean.copy()
    behind.suppose(Frame(0, 10**12, developed(empty_canvas(CAMERA)), available_ns=0))
    known = np.kron(behind.room.looks > SUPPOSED, np.ones((TILE_PX, TILE_PX))) > 0.0
    assert known.mean() > 0.5
    assert np.array_equal(behind.room.mean[known], before[known])
