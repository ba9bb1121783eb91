"""The yaw watch of a link, fed by whatever comes in."""

from __future__ import annotations

import math

from bridge.dialogue.heading import ATTITUDE, HeadingWatch
from tests.bridge.dialogue.far_autopilot import from_autopilot
from tests.bridge.dialogue.flights import fly


def test_an_attitude_without_numbers_does_not_blind_the_watch() -> None:
    watch = HeadingWatch()
    for k, sample in enumerate(fly(1, yaw_error_deg=60.0)):
        wrong = math.nan if k % 5 == 0 else math.inf
        for roll, pitch in ((sample.roll, sample.pitch), (wrong, wrong)):
            watch.take(from_autopilot(ATTITUDE, sample.t_ns, roll=roll, pitch=pitch))
        watch.take_pose(sample.t_ns, sample.v_N, sample.yaw, True, sample.t_ns)
    assert watch.reading.alarm
