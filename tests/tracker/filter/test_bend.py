"""What a pose left open does to pixels beyond first order, against drawn errors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.tracker.rigs import PROCESS, ring_rig, state
from tracker.filter.bend import bend_noise
from tracker.filter.correction import moved
from tracker.filter.measure import camera_table, marker_points, pixels
from tracker.filter.pivot import moved_to
from tracker.types import Array

RIG = ring_rig(2)
FLYING = state(0, (0.2, -0.1, 0.1), (12.0, -8.0, 130.0))
ONE_CAMERA = np.zeros(2, dtype=np.int64), np.array([0, 1]), np.zeros(2)
SIZE = 25


def seen(mean: Array, points_inB: Array) -> tuple[Array, Array]:
    return pixels(mean, PROCESS.manoeuvre_s, *ONE_CAMERA, camera_table(RIG), points_inB)


def bend(mean: Array, P_pose: Array, points_inB: Array) -> Array:
    P = np.zeros((SIZE, SIZE))
    P[:6, :6] = P_pose
    return bend_noise(mean, np.zeros(SIZE), P, PROCESS.manoeuvre_s, *ONE_CAMERA, camera_table(RIG), points_inB)


@pytest.mark.parametrize("seed", range(4))
def test_it_is_what_drawn_errors_leave_beside_their_tangent(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ways = rng.normal(size=(2, 6)) * np.repeat([0.02, 0.1], 3)
    points = marker_points(RIG)
    h, H = seen(FLYING.mean, points)
    left = []
    for error in rng.normal(size=(4000, 2)) @ ways:
        step = np.concatenate((error, np.zeros(SIZE - 6)))
        there, _ = seen(moved(FLYING.mean, step, np.empty((3, 3)), np.empty((3, 3))), points)
        left.append(there - h - H @ step)
    drawn = np.mean([np.outer(one, one) for one in left], axis=0)
    assert np.trace(bend(FLYING.mean, ways.T @ ways, points)) == pytest.approx(np.trace(drawn), rel=0.15)


def test_a_turn_about_the_line_of_the_balls_that_are_seen_bends_nothing() -> None:
    points = marker_points(RIG)
    axis = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    about, _ = moved_to(FLYING.mean, points[0], SIZE)
    P = np.zeros((6, 6))
    P[3:, 3:] = 0.5**2 * np.outer(axis, axis)
    assert np.abs(bend(about, P, points - points[0])).max() < 1e-12


def test_it_does_not_depend_on_the_body_axes() -> None:
    turn = Rotation.from_euler("xyz", (40.0, -30.0, 70.0), degrees=True).as_matrix()
    spread = np.diag([0.02, 0.01, 0.03, 0.1, 0.2, 0.05]) ** 2
    J = np.eye(6)
    J[3:, 3:] = turn.T
    points = marker_points(RIG)
    turned = FLYING.mean.copy()
    turned[3:12] = (FLYING.R_BtoW @ turn).reshape(-1)
    there = bend(turned, J @ spread @ J.T, points @ turn)
    assert np.allclose(there, bend(FLYING.mean, spread, points), rtol=1e-3)
