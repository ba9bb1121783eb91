"""What the room behind the vehicle tells of a camera, on rendered pictures."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tracker.paper_rig import paper_rig
from tracker.health.background import PASS_NS, Background
from tracker.health.mend import turned
from tracker.health.patch import MOST, choose_patches
from tracker.health.shift import find_shift
from tracker.maths import so3
from tracker.scene import Knock, SceneRenderer, Trouble
from tracker.scene.knock import knocked
from tracker.scene.trouble import NO_TROUBLE
from tracker.standing import Witness
from tracker.types import Array, Image

RIG = paper_rig()
CAMERA = RIG.cameras[0]
FRAME_NS = 66_666_667
NOWHERE = [(np.array([0.0, 0.0, -5.0]), np.eye(3))]
SETTLED = round(3.2 * PASS_NS / FRAME_NS)


class Room:
    """A camera's pictures of a room without a vehicle, one after the other."""

    def __init__(self, backdrops: list[Image] | None = None) -> None:
        self._renderer = SceneRenderer(RIG, seed=3, backdrops=backdrops)
        self.background = Background(CAMERA)
        self._t_ns = 0

    def seen(self, trouble: Trouble = NO_TROUBLE, frames: int = SETTLED) -> Background:
        """Watch for so many frames."""
        for _ in range(frames):
            self._t_ns += FRAME_NS
            self.background.look(self._renderer.render(0, NOWHERE, trouble), self._t_ns)
        return self.background


@pytest.fixture(scope="module")
def still() -> Background:
    return Room().seen()


def test_a_room_that_stands_still_is_seen_to_do_so_to_a_tenth_of_a_pixel(still: Background) -> None:
    assert still.witness is Witness.STILL
    assert still.newest is not None
    assert still.newest.largest_px < 0.1


@pytest.mark.parametrize("degrees", [(0.1, 0.0, 0.0), (0.0, -0.2, 0.0), (0.0, 0.0, 0.2)])
def test_a_turned_camera_is_turned_back_to_where_it_looks(degrees: tuple[float, float, float]) -> None:
    room, knock = Room(), Knock(0, turn_deg=degrees)
    room.seen()
    background = room.seen(Trouble(knocks=(knock,)))
    assert background.witness is Witness.MOVED
    assert background.shift is not None
    left_over = so3.log(knocked(CAMERA, knock).R_CtoW.T @ turned(CAMERA, background.shift).R_CtoW)
    assert np.degrees(np.linalg.norm(left_over)) < 0.02


def test_a_camera_that_was_turned_far_is_found_to_look_elsewhere() -> None:
    room = Room()
    room.seen()
    background = room.seen(Trouble(knocks=(Knock(0, turn_deg=(0.0, 0.5, 0.0)),)))
    assert background.witness is Witness.MOVED
    assert background.newest is not None
    assert background.newest.largest_px == pytest.approx(CAMERA.focal_px * np.radians(0.5), rel=0.1)


def test_light_that_fails_is_no_motion() -> None:
    room = Room()
    room.seen()
    assert room.seen(Trouble(light_gain=0.0)).witness is Witness.BLIND
    assert room.seen().witness is Witness.STILL


def test_a_bare_wall_tells_nothing() -> None:
    bare = [np.full((480, 640, 3), 190, np.uint8)] * len(RIG.cameras)
    room = Room(bare)
    room.seen(frames=3)
    assert room.seen(Trouble(knocks=(Knock(0, turn_deg=(1.0, 0.0, 0.0)),)), frames=3).witness is Witness.BLIND


def test_patches_lie_apart_and_off_the_vehicle() -> None:
    image = SceneRenderer(RIG, seed=3).render(0, NOWHERE)
    patches = choose_patches(image, np.array([[320.0, 240.0]]), 100.0)
    places = np.array([(patch.u_px, patch.v_px) for patch in patches])
    assert len(places) == MOST
    assert np.linalg.norm(places - [320.0, 240.0], axis=1).min() >= 99.0
    assert min(np.linalg.norm(a - b) for k, a in enumerate(places) for b in places[:k]) > 30.0


def patches_moved(rng: np.random.Generator, motion: Array, liars: int) -> tuple[Array, Array]:
    """Return places of ten patches and their motions, of which so many have nothing to do with the picture's."""
    xy = rng.uniform(-300.0, 300.0, (10, 2))
    u, v, turn, zoom = motion
    moved = np.array([u, v]) + zoom * xy + turn * np.stack((-xy[:, 1], xy[:, 0]), axis=1)
    moved += rng.normal(0.0, 0.03, moved.shape)
    moved[:liars] += rng.uniform(2.0, 5.0, (liars, 2))
    return xy, moved


@pytest.mark.parametrize("seed", range(5))
def test_a_shift_is_found_within_its_covariance_whatever_three_of_ten_do(seed: int) -> None:
    rng, truth = np.random.default_rng(seed), np.array([1.2, -0.7, 0.002, -0.001])
    xy, moved = patches_moved(rng, truth, liars=3)
    found = find_shift(xy, moved, np.full(10, 0.03))
    assert found is not None
    error = found.motion - truth
    assert error @ np.linalg.solve(found.covariance, error) < 25.0
    assert found.patches == 7


def test_no_shift_is_found_where_no_majority_agrees() -> None:
    rng = np.random.default_rng(1)
    assert find_shift(rng.uniform(-300, 300, (10, 2)), rng.uniform(-5, 5, (10, 2)), np.full(10, 0.03)) is None


def test_the_cameras_of_a_rig_take_turns_in_looking() -> None:
    image = SceneRenderer(RIG, seed=3).render(0, NOWHERE, NO_TROUBLE)
    backgrounds = [Background(CAMERA, ahead=share) for share in (0.0, 0.5)]
    together = 0
    for t_ns in range(FRAME_NS, 2 * PASS_NS, FRAME_NS):
        together += all(background.due_ns <= t_ns for background in backgrounds)
        for background in backgrounds:
            background.look(image, t_ns)
    assert together <= 2  # to choose the patches, and for the first of them
