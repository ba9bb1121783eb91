"""The yaw watch of a link, fed by whatever comes in."""

from __future__ import annotations

import math
from collections import deque

import pytest

from bridge.dialogue.heading import ATTITUDE, HeadingWatch
from tests.bridge.dialogue.far_autopilot import from_autopilot
from tests.bridge.dialogue.flights import Sample, fly


def test_an_attitude_without_numbers_does_not_blind_the_watch() -> None:
    watch = HeadingWatch()
    for k, sample in enumerate(fly(1, yaw_error_deg=60.0)):
        wrong = math.nan if k % 5 == 0 else math.inf
        for roll, pitch in ((sample.roll, sample.pitch), (wrong, wrong)):
            watch.take(from_autopilot(ATTITUDE, sample.t_ns, roll=roll, pitch=pitch))
        watch.take_pose(sample.t_ns, sample.v_N, sample.yaw, True)
    assert watch.reading.alarm


@pytest.mark.parametrize("lag_rounds", [0, 1, 4, 15])
def test_a_pose_that_waited_is_held_against_the_tilt_of_its_own_instant(lag_rounds: int) -> None:
    """In a circle a tilt a second late would point the other way."""
    watch, waiting = HeadingWatch(), deque[Sample]()
    for sample in fly(1, circle_rad_s=2.0):
        watch.take(from_autopilot(ATTITUDE, sample.t_ns, roll=sample.roll, pitch=sample.pitch))
        waiting.append(sample)
        if len(waiting) > lag_rounds:
            pose = waiting.popleft()
            watch.take_pose(pose.t_ns, pose.v_N, pose.yaw, True)
    assert watch.reading.known
    assert abs(watch.reading.error_deg) < 10.0
    assert not watch.reading.alarm
