"""Attitude and position from three points: the paper's equations 4 to 6, exact without noise."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tracker.paper_rig import paper_rig
from tests.tracker.rigs import moved_marker
from tracker.maths import so3
from tracker.rig import Marker
from tracker.start.pose3 import attitude, pose
from tracker.types import Array, Reason, Rejected

MARKER = paper_rig().marker
IN_THE_ENVELOPE = st.floats(-math.radians(20.0), math.radians(20.0))
WIDE = st.floats(-math.radians(85.0), math.radians(85.0))
YAW = st.floats(-math.pi, math.pi)
PLACE = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)).map(np.array)


def placed(marker: Marker, R_BtoW: Array, p_BinW: Array) -> Array:
    return np.asarray(marker.points_inB @ R_BtoW.T + p_BinW)


def apart_deg(R: Array, other: Array) -> float:
    return math.degrees(float(np.linalg.norm(so3.log(R.T @ other))))


@given(IN_THE_ENVELOPE, IN_THE_ENVELOPE, YAW, PLACE)
def test_equations_4_to_6_are_exact_over_the_papers_envelope(
    roll: float, pitch: float, yaw: float, p_BinW: Array
) -> None:
    R_BtoW = so3.from_euler(roll, pitch, yaw)
    points = placed(MARKER, R_BtoW, p_BinW)
    found = attitude(*points)
    assert not isinstance(found, Rejected)
    assert np.allclose(found[:2], (roll, pitch), atol=1e-9)
    assert math.cos(found[2] - yaw) == pytest.approx(1.0, abs=1e-12)
    posed = pose(points, MARKER)
    assert not isinstance(posed, Rejected)
    assert np.allclose(posed[0], p_BinW, atol=1e-9)
    assert np.allclose(posed[1], R_BtoW, atol=1e-9)


@given(WIDE, WIDE, YAW)
def test_they_are_exact_far_beyond_it_too(roll: float, pitch: float, yaw: float) -> None:
    R_BtoW = so3.from_euler(roll, pitch, yaw)
    found = pose(placed(MARKER, R_BtoW, np.zeros(3)), MARKER)
    assert not isinstance(found, Rejected)
    assert apart_deg(found[1], R_BtoW) < 1e-4


def test_the_corner_3_need_not_stand_over_the_middle_of_1_and_2() -> None:
    """2' is the foot of the perpendicular, wherever it lies."""
    corner = np.array([[0.0, 0.0, 0.0], [0.16, 0.0, 0.0], [0.19, 0.07, 0.0]])
    found = attitude(*corner @ so3.from_euler(0.3, -0.2, 2.5).T)
    assert not isinstance(found, Rejected)
    assert np.allclose(found, (0.3, -0.2, 2.5))


@given(IN_THE_ENVELOPE, IN_THE_ENVELOPE, YAW, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), YAW, PLACE)
def test_the_markers_axes_need_not_be_the_bodys(
    roll: float, pitch: float, yaw: float, mounted_roll: float, mounted_pitch: float, mounted_yaw: float, at_m: Array
) -> None:
    marker = moved_marker(MARKER, so3.from_euler(mounted_roll, mounted_pitch, mounted_yaw), 0.1 * at_m)
    R_BtoW = so3.from_euler(roll, pitch, yaw)
    found = pose(placed(marker, R_BtoW, at_m), marker)
    assert not isinstance(found, Rejected)
    assert np.allclose(found[0], at_m, atol=1e-9)
    assert apart_deg(found[1], R_BtoW) < 1e-6


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 2, 0), (2, 0, 1), (1, 0, 2), (0, 2, 1), (2, 1, 0)])
def test_the_balls_may_be_named_in_any_order(order: tuple[int, ...]) -> None:
    """Three of the six orders run clockwise seen from above: 3 lies to the right of the line from 1 to 2."""
    marker = moved_marker(MARKER, np.eye(3), np.zeros(3), order)
    R_BtoW = so3.from_euler(math.radians(15.0), math.radians(-10.0), math.radians(70.0))
    found = pose(placed(marker, R_BtoW, np.zeros(3)), marker)
    assert not isinstance(found, Rejected)
    assert apart_deg(found[1], R_BtoW) < 1e-6


def test_a_fourth_ball_counts_for_the_position() -> None:
    points = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, 0.1, 0.05]])
    marker = Marker(MARKER.balls, points)
    seen = points + np.array([0.0, 0.0, 1.0])
    seen[3, 2] += 0.04
    found = pose(seen, marker)
    assert not isinstance(found, Rejected)
    assert np.allclose(found[0], (0.0, 0.0, 1.01))


@pytest.mark.parametrize("pitch_deg", [90.0, -90.0, 89.5, -89.5])
@pytest.mark.parametrize("roll_deg", [0.0, 30.0])
def test_pitch_90_is_rejected_and_said_so(pitch_deg: float, roll_deg: float) -> None:
    R_BtoW = so3.from_euler(math.radians(roll_deg), math.radians(pitch_deg), 0.4)
    found = pose(placed(MARKER, R_BtoW, np.zeros(3)), MARKER)
    assert isinstance(found, Rejected)
    assert found.reason is Reason.SINGULAR
    assert f"pitch {pitch_deg:.1f} deg, limit +/-89 deg" in found.detail


@pytest.mark.parametrize(
    "points",
    [((0, 0, 0), (0, 0, 0), (0, 1, 0)), ((0, 0, 0), (1, 0, 0), (2, 0, 0)), ((0, 0, 0), (1, 0, 0), (0, 0, 0))],
)
def test_points_in_a_line_are_rejected(points: tuple[tuple[float, float, float], ...]) -> None:
    found = attitude(*np.array(points, dtype=float))
    assert isinstance(found, Rejected)
    assert found.reason is Reason.GEOMETRY
