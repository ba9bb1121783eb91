"""The yaw watch against flights of a vehicle with thrust, drag, wind and gusts, whose yaw is reported wrong."""

from __future__ import annotations

import numpy as np
import pytest

from bridge.dialogue.yaw_watch import ALARM_DEG, YawReading, YawWatch, tilt_acceleration
from tests.bridge.dialogue.flights import Sample, fly
from tracker.maths import so3


def watched(samples: list[Sample]) -> YawReading:
    watch = YawWatch()
    for sample in samples:
        watch.take_tilt(sample.roll, sample.pitch)
        watch.take_pose(sample.t_ns, sample.v_N, sample.yaw)
    return watch.reading()


@pytest.mark.parametrize("error_deg", [-90.0, -20.0, 0.0, 7.0, 45.0, 90.0, 170.0])
def test_the_error_of_the_yaw_is_found(error_deg: float) -> None:
    reading = watched(list(fly(1, yaw_error_deg=error_deg)))
    assert reading.known
    assert abs(reading.error_deg - error_deg) < 3.0 * reading.sigma_deg
    assert reading.sigma_deg < 3.0
    assert reading.gain == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("error_deg", [-10.0, 0.0, 10.0])
def test_a_yaw_that_flies_well_gives_no_alarm(error_deg: float) -> None:
    alarms = []
    for seed in range(5):
        watch = YawWatch()
        for sample in fly(seed, 60.0, error_deg):
            watch.take_tilt(sample.roll, sample.pitch)
            watch.take_pose(sample.t_ns, sample.v_N, sample.yaw)
            alarms.append(watch.reading().alarm)
    assert not any(alarms)


@pytest.mark.parametrize("error_deg", [45.0, -90.0, 180.0])
def test_a_yaw_that_flies_away_is_told_within_eight_seconds(error_deg: float) -> None:
    """A real autopilot with 90 deg was 200 m away after 11 to 20 s."""
    for seed in range(5):
        assert "steers the wrong way" in watched(list(fly(seed, 8.0, error_deg))).alarm


def test_the_standard_error_is_not_too_small_and_less_than_twice_too_large() -> None:
    """Drag and steady acceleration drawn from what the watch believes of them; four sigma of a mean of 60 squares."""
    random = np.random.default_rng(7)
    ratios = []
    for seed in range(60):
        drag, steady = 0.3 + 0.25 * random.standard_normal(), 0.5 * random.standard_normal(2)
        flown = list(fly(seed, 20.0, 20.0, drag_1_s=drag, steady=(steady[0], steady[1]), gust_m_s2=0.15))
        reading = watched(flown)
        ratios.append((reading.error_deg - 20.0) / reading.sigma_deg)
    assert 0.25 < float(np.mean(np.square(ratios))) < 1.0 + 4.0 * np.sqrt(2.0 / 60.0)


def test_drag_in_a_circle_is_not_taken_for_yaw() -> None:
    """At 1 rad/s drag of 0.4 /s turns the acceleration by 22 deg against the tilt."""
    reading = watched(list(fly(2, 60.0, circle_rad_s=1.0, drag_1_s=0.4, steady=(0.0, 0.0))))
    assert abs(reading.error_deg) < 2.0 * reading.sigma_deg
    assert not reading.known
    assert reading.alarm == ""
    flown_away = watched(list(fly(2, 60.0, 120.0, circle_rad_s=1.0, drag_1_s=0.4, steady=(0.0, 0.0))))
    assert flown_away.alarm != ""


def test_a_vehicle_that_stands_still_tells_nothing() -> None:
    still = [Sample(round(k * 1e9 / 15), np.zeros(2), 0.3, 0.01, 0.02) for k in range(600)]
    reading = watched(still)
    assert not reading.known
    assert reading.alarm == ""


def test_without_tilt_or_poses_nothing_is_known() -> None:
    watch = YawWatch()
    for sample in fly(3):
        watch.take_pose(sample.t_ns, sample.v_N, sample.yaw)
    assert not watch.reading().known


def test_gaps_and_steps_back_in_time_are_left_out() -> None:
    samples = list(fly(4, 60.0, 30.0))
    kept = [sample for sample in samples if not 20e9 < sample.t_ns < 30e9]
    reading = watched([*kept, samples[0]])
    assert abs(reading.error_deg - 30.0) < 3.0 * reading.sigma_deg


def test_what_a_tilt_accelerates_is_the_mast_leaning_over() -> None:
    """Thrust T along the mast, -z of the body, with T's vertical part bearing the weight."""
    for roll, pitch, yaw in ((0.1, -0.2, 0.7), (-0.3, 0.25, -2.0)):
        mast = -so3.from_euler(roll, pitch, yaw)[:, 2]
        np.testing.assert_allclose(tilt_acceleration(roll, pitch, yaw), 9.81 * mast[:2] / -mast[2], rtol=1e-12)


def test_the_alarm_lies_between_what_flies_and_what_circles() -> None:
    assert 10.0 < ALARM_DEG < 20.0
