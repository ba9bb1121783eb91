"""Too little of the marker carries no track, and a camera that has just lost it is noticed, once."""

from __future__ import annotations

import numpy as np
import pytest

from tracker.attendance import POSED_NS, Attendance
from tracker.types import BallSighting, frozen_array

BOTH = (0, 1)
ALL = ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2))
IN_ONE = ((0, 0), (0, 1), (0, 2))


def seen(*pairs: tuple[int, int], t_ns: int = 0) -> list[BallSighting]:
    return [
        BallSighting(camera, ball, t_ns, frozen_array(np.zeros(2)), frozen_array(np.eye(2))) for camera, ball in pairs
    ]


def test_a_camera_that_has_just_lost_the_marker_is_noticed_once() -> None:
    one = Attendance()
    told = []
    for pairs in (ALL, IN_ONE, IN_ONE, ALL, IN_ONE):
        one.take(seen(*pairs), BOTH)
        told.append(one.fell_silent)
    assert told == [False, True, False, False, True]


def test_a_camera_that_did_not_look_has_lost_nothing() -> None:
    """Free-running cameras look in turn; so does one whose frame is late or lost."""
    one = Attendance()
    one.take(seen(*ALL), BOTH)
    for pairs, camera in ((IN_ONE, 0), (((1, 0), (1, 1), (1, 2)), 1), (IN_ONE, 0)):
        one.take(seen(*pairs), (camera,))
        assert not one.fell_silent
    one.take(seen((1, 0)), BOTH)
    assert one.fell_silent


@pytest.mark.parametrize(
    ("pairs", "hardly"), [(IN_ONE, False), (((0, 0), (1, 1)), True), (((0, 2), (1, 2), (0, 2)), True)]
)
def test_fewer_than_make_a_pose_are_hardly_any_once_the_others_are_forgotten(
    pairs: tuple[tuple[int, int], ...], hardly: bool
) -> None:
    one = Attendance()
    one.take(seen(*ALL), BOTH)
    one.take(seen(*pairs, t_ns=POSED_NS), BOTH)
    assert not one.hardly_any
    one.take(seen(*pairs, t_ns=POSED_NS + 1), BOTH)
    assert one.hardly_any is hardly
