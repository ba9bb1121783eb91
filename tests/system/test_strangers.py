"""Things in the room that look like balls, or come between, make no pose wrong."""

from __future__ import annotations

import numpy as np
import pytest

from tests.system import flights
from tests.system.flights import FIRST_S, LAST_S, RIG, Case, during, place
from tracker.scene import Sphere, Trouble, hand
from tracker.types import Array

GREEN, ORANGE = 1, 2


def look_alikes(green_inW: Array, orange_inW: Array, radius_m: float = 0.0075) -> Trouble:
    """Stand a green and an orange ball in the room."""
    balls = [
        Sphere((float(p[0]), float(p[1]), float(p[2])), radius_m, RIG.marker.balls[ball].colour.bgr)
        for ball, p in ((GREEN, green_inW), (ORANGE, orange_inW))
    ]
    return Trouble(things=tuple(balls))


FAR = look_alikes(np.array([0.30, -0.35, 0.20]), np.array([-0.35, 0.20, -0.15]))
LARGE = look_alikes(np.array([0.30, -0.35, 0.20]), np.array([-0.35, 0.20, -0.15]), 0.012)
# Beside the way: the vehicle passes them closely in the middle of the flight.
NEAR = look_alikes(place(2.5) + np.array([0.14, 0.0, 0.03]), place(2.5) + np.array([0.0, -0.14, -0.03]))


def all_along(trouble: Trouble) -> flights.Fault:
    return lambda _camera, _t_s: trouble


def passing_hand(height_m: float, along: Array) -> flights.Fault:
    """Move a hand over the place where the vehicle flies, 0.8 m in a second."""

    def fault(_camera: int, t_s: float) -> Trouble:
        if not FIRST_S <= t_s < LAST_S:
            return Trouble()
        at = place(2.5) + along * (0.8 * (t_s - FIRST_S) - 0.4) + np.array([0.0, 0.0, height_m])
        return Trouble(things=hand(at, along))

    return fault


MOST = flights.FRAMES - 15
CASES = [
    Case("two look-alikes in the room", all_along(FAR)),
    Case("two larger look-alikes in the room", all_along(LARGE)),
    Case("two look-alikes put beside the vehicle", during(NEAR)),
    Case("two look-alikes beside the way", all_along(NEAR)),
    Case("a hand passes over the marker", passing_hand(0.10, np.array([1.0, 0.0, 0.0])), least=MOST),
    Case("a hand passes across", passing_hand(0.15, np.array([0.7071, -0.7071, 0.0])), least=MOST),
    Case("a hand passes under the marker", passing_hand(-0.12, np.array([0.0, 1.0, 0.0])), least=MOST),
]
each_case = pytest.mark.parametrize("case", CASES, ids=str)


@each_case
def test_no_pose_is_wrong(case: Case) -> None:
    flights.assert_no_pose_is_wrong(case)


@each_case
def test_the_track_is_kept(case: Case) -> None:
    flights.assert_the_track_is_kept(case)


@each_case
def test_nothing_is_called_a_jump(case: Case) -> None:
    flights.assert_the_counter_tells_jumps(case)


@each_case
def test_accuracy_returns(case: Case) -> None:
    flights.assert_accuracy_returns(case)
