"""The guided frame check: pushes as they should be, and each of the mistakes that people make."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.preflight.axes import EXPECTED, axes_of
from bridge.preflight.frame_check import Witness, judge_frames
from bridge.preflight.verdict import Line, Mark
from tracker.types import Array

WAY = 0.5 * EXPECTED
MOVES = np.eye(3)


def turn(heading_deg: float) -> Array:
    """Clockwise from north to east, about down."""
    c, s = np.cos(np.radians(heading_deg)), np.sin(np.radians(heading_deg))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def witness(frame: Array = MOVES, yaw_deg: float = 0.0, roll_deg: float = 0.0, size: float = 1.0) -> Witness:
    """What is seen when the frame of positions is turned by `frame` and the yaw is off by yaw_deg."""
    return Witness(size * WAY @ frame.T, roll_deg, 0.0, yaw_deg)


def failing(lines: tuple[Line, ...]) -> dict[str, Line]:
    return {line.what: line for line in lines if line.mark is Mark.FAIL}


def test_a_frame_that_is_right_passes_every_line() -> None:
    lines = judge_frames(witness(), witness())
    assert {line.mark for line in lines} == {Mark.PASS}
    assert [line.what for line in lines] == [
        "frame: axes", "frame: north", "frame: yaw against motion", "frame: level", "frame: autopilot follows",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("heading_deg", "advice"),
    [
        (90.0, "your room_yaw_deg is 90 too large: lower it by 90"),
        (-90.0, "your room_yaw_deg is 90 too small: raise it by 90"),
        (83.0, "your room_yaw_deg is 90 too large: lower it by 90"),
        (45.0, "your room_yaw_deg is 45 too large: lower it by 45"),
        (180.0, "180"),
    ],
)
def test_a_room_turned_as_a_whole_is_a_wrong_room_yaw(heading_deg: float, advice: str) -> None:
    seen = witness(turn(heading_deg), heading_deg)
    failed = failing(judge_frames(seen, seen))
    assert list(failed) == ["frame: north"]
    assert advice in failed["frame: north"].fix


@pytest.mark.parametrize(
    ("error_deg", "advice"),
    [
        (90.0, "points 90 deg to the right of the nose: turn position_mm of all balls by -90 deg"),
        (-90.0, "points 90 deg to the left of the nose: turn position_mm of all balls by +90 deg"),
        (180.0, "180 deg"),
        (20.0, "20 deg to the right"),
    ],
)
def test_a_yaw_that_does_not_fit_the_motion_is_a_turned_marker(error_deg: float, advice: str) -> None:
    seen = witness(yaw_deg=error_deg)
    failed = failing(judge_frames(seen, seen))
    assert list(failed) == ["frame: yaw against motion"]
    assert advice in failed["frame: yaw against motion"].fix


def test_both_mistakes_at_once_are_told_apart() -> None:
    """The room is turned by 90 deg and the marker by -90: the yaw reads 0 as it should, and flies away."""
    seen = witness(turn(90.0), 0.0)
    failed = failing(judge_frames(seen, seen))
    assert list(failed) == ["frame: north", "frame: yaw against motion"]


@pytest.mark.parametrize(
    ("frame", "advice"),
    [
        (np.diag([1.0, -1.0, 1.0]), "wrong sign"),
        (np.diag([-1.0, 1.0, 1.0]), "wrong sign"),
        (np.diag([1.0, 1.0, -1.0]), "z is upside down"),
        (np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), "x and y of the room are swapped"),
    ],
)
def test_a_mirror_is_refused(frame: Array, advice: str) -> None:
    seen = witness(frame)
    failed = failing(judge_frames(seen, seen))
    assert "mirrored" in failed["frame: axes"].found
    assert advice in failed["frame: axes"].fix


def test_a_room_lying_on_its_side_or_upside_down_is_refused() -> None:
    for frame in (np.diag([1.0, -1.0, -1.0]), np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])):
        seen = witness(frame)
        assert "z points up" in failing(judge_frames(seen, seen))["frame: axes"].fix


def test_a_marker_upside_down_is_refused() -> None:
    assert "upside-down" in failing(judge_frames(witness(roll_deg=180.0), witness()))["frame: level"].fix


def test_an_autopilot_that_stays_where_it_was_does_not_use_the_poses() -> None:
    failed = failing(judge_frames(witness(), witness(size=0.05)))
    assert "does not use the poses" in failed["frame: autopilot follows"].fix


def test_an_autopilot_that_turns_the_poses_is_refused() -> None:
    failed = failing(judge_frames(witness(), witness(turn(90.0), 90.0)))
    assert "VISO_ORIENT 0" in failed["frame: autopilot follows"].fix


def test_an_autopilot_that_goes_another_length_is_refused() -> None:
    assert "VISO_SCALE" in failing(judge_frames(witness(), witness(size=1.3)))["frame: autopilot follows"].fix


def test_a_silent_autopilot_is_refused() -> None:
    assert failing(judge_frames(witness(), None))["frame: autopilot follows"].found == "no position from it"


def test_a_push_of_a_hands_breadth_is_asked_for_again() -> None:
    pushes = WAY.copy()
    pushes[1] *= 0.1
    (line,) = judge_frames(Witness(pushes, 0.0, 0.0, 0.0), None)
    assert line.mark is Mark.FAIL
    assert "right" in line.found


def test_each_of_the_48_ways_to_name_three_axes_is_told_from_the_others() -> None:
    seen = set()
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            P = np.eye(3)[list(order)] * np.array(signs)[:, None]
            axes = axes_of(WAY @ P.T)
            np.testing.assert_array_equal(axes.P, P)
            assert axes.mirrored == (np.linalg.det(P) < 0)
            seen.add(axes.outcomes())
    assert len(seen) == 48


@given(
    st.floats(-179.0, 179.0),
    st.lists(st.floats(-8.0, 8.0), min_size=3, max_size=3),
    st.lists(st.floats(0.2, 1.5), min_size=3, max_size=3),
)
def test_pushes_by_hand_give_the_heading_all_the_same(
    heading_deg: float, astray_deg: list[float], lengths: list[float]
) -> None:
    """Each push is up to 8 deg astray and of any length; the heading is right within that."""
    pushes = np.array(
        [length * turn(off) @ row for length, off, row in zip(lengths, astray_deg, EXPECTED, strict=True)]
    )
    axes = axes_of(pushes @ turn(heading_deg).T)
    assert not axes.mirrored
    assert axes.upright
    assert abs((axes.heading_deg - heading_deg + 180.0) % 360.0 - 180.0) < 8.01
