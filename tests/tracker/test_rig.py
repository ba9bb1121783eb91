"""Markers and rigs that can be tracked, and those that cannot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.paper_rig import paper_camera, paper_rig
from tracker.errors import OperatorError
from tracker.rig import Ball, Colour, make_marker, make_rig
from tracker.types import frozen_array

RED = Colour(0.0, 10.0, 0.5, 0.5, (0, 0, 255))


def ball(name: str, x: float, y: float, radius_m: float = 0.01) -> Ball:
    return Ball(name, frozen_array((x, y, 0.0)), radius_m, RED)


def test_a_marker_holds_the_balls_centres_in_order() -> None:
    marker = make_marker((ball("a", 0.0, 0.0), ball("b", 0.1, 0.0), ball("c", 0.0, 0.1), ball("d", 0.1, 0.1)))
    assert len(marker) == 4
    assert marker.points_inB.tolist() == [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, 0.1, 0.0]]
    with pytest.raises(ValueError, match="read-only"):
        marker.points_inB[0] = 1.0


@pytest.mark.parametrize(
    ("balls", "complaint"),
    [
        ((ball("a", 0.0, 0.0), ball("b", 0.1, 0.0)), "2 balls; at least 3"),
        ((ball("a", 0.0, 0.0), ball("b", 0.1, 0.0), ball("a", 0.0, 0.1)), "a, b, a must differ"),
        ((ball("a", 0.0, 0.0), ball("b", 0.1, 0.0), ball("c", 0.0, 0.1, 0.0)), "ball c has radius 0 mm"),
        ((ball("a", 0.0, 0.0), ball("b", 0.1, 0.0), ball("c", 0.0, 0.1, np.nan)), "ball c has radius nan mm"),
        ((ball("a", 0.0, 0.0), ball("b", 0.1, 0.0), ball("c", 0.2, 0.0)), "in a line within 0 mm, limit 5 mm"),
        ((ball("a", 0.0, 0.0), ball("b", 0.1, 0.003), ball("c", 0.2, 0.0)), "in a line within 2.4 mm, limit 5 mm"),
        (
            (ball("a", 0.1, 0.0), ball("b", 0.1, 0.0), ball("c", 0.1, 0.0)),
            "are 0 mm apart, their radii need 20 mm",
        ),
        ((ball("a", 0.0, 0.0), ball("b", 1e-4, 0.0), ball("c", 0.0, 1e-4)), "0.1 mm apart"),
        ((ball("a", 0.0, 0.0), ball("b", 0.1, 0.0), ball("c", 0.0, 0.1, 1e-5)), "radius 0.01 mm, at least 1 mm"),
    ],
)
def test_a_marker_whose_attitude_cannot_be_seen_is_refused(balls: tuple[Ball, ...], complaint: str) -> None:
    with pytest.raises(OperatorError) as caught:
        make_marker(balls)
    assert complaint in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("count", "good"), [(0, False), (1, False), (2, True), (8, True), (9, False)])
def test_a_rig_has_two_to_eight_cameras(count: int, good: bool) -> None:
    cameras = tuple(paper_camera(f"cam{i}", 30.0 * i, (0.0,) * 4) for i in range(count))
    if good:
        assert len(make_rig(cameras, paper_rig().marker).cameras) == count
    else:
        with pytest.raises(OperatorError, match=f"{count} cameras; 2 to 8 work"):
            make_rig(cameras, paper_rig().marker)


def test_cameras_placed_in_millimetres_are_refused() -> None:
    near, far = (paper_camera(f"cam{i}", 180.0 * i, (0.0,) * 4) for i in range(2))
    far = replace(far, p_CinW=frozen_array(1e3 * far.p_CinW))
    with pytest.raises(OperatorError, match=r"cam0 and cam1 stand \d+ m apart, limit 200 m; .* are in metres"):
        make_rig((near, far), paper_rig().marker)
