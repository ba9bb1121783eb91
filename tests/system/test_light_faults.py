"""Light, exposure and colours that change in flight make no pose wrong."""

from __future__ import annotations

import pytest

from tests.system import flights
from tests.system.flights import DURATION_S, FIRST_S, FRAMES, RATE_HZ, RIG, Case, during
from tracker.scene import Trouble


def cast(blue: float, red: float) -> flights.Fault:
    """Change the light's colour within half a second, for good."""

    def fault(_camera: int, t_s: float) -> Trouble:
        share = min(max((t_s - FIRST_S) / 0.5, 0.0), 1.0)
        return Trouble(gains_bgr=(1.0 + share * (blue - 1.0), 1.0, 1.0 + share * (red - 1.0)))

    return fault


PAINTS = [ball.colour.bgr for ball in RIG.marker.balls]
ALL_SWAPPED = Trouble(repainted=((0, PAINTS[1]), (1, PAINTS[2]), (2, PAINTS[0])))


def swapped(one: int, other: int) -> Trouble:
    return Trouble(repainted=((one, PAINTS[other]), (other, PAINTS[one])))


ONE_FRAME_S = FIRST_S + 0.5 / RATE_HZ
CASES = [
    Case("light 20 percent bluer, less red", cast(1.2, 0.8)),
    Case("light 20 percent redder, less blue", cast(0.8, 1.2)),
    Case("colour cast in one camera at once", during(Trouble(gains_bgr=(1.2, 1.0, 0.8)), [1], last_s=DURATION_S)),
    Case("exposure halved in camera 0", during(Trouble(light_gain=0.5), [0], last_s=DURATION_S)),
    Case("exposure halved in camera 1", during(Trouble(light_gain=0.5), [1], last_s=DURATION_S)),
    Case("light halved for a second", during(Trouble(light_gain=0.5))),
    Case("yellow and green swapped for a frame", during(swapped(0, 1), last_s=ONE_FRAME_S), least=FRAMES - 1),
    Case("green and orange swapped for a frame", during(swapped(1, 2), last_s=ONE_FRAME_S), least=FRAMES - 1),
    Case("all colours swapped round for a frame", during(ALL_SWAPPED, last_s=ONE_FRAME_S), least=FRAMES - 1),
    Case("yellow and green swapped for long", during(swapped(0, 1), last_s=2.8), last_s=2.8, least=FRAMES - 12),
    Case("green and orange swapped in camera 0", during(swapped(1, 2), [0], last_s=ONE_FRAME_S), least=FRAMES - 1),
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
