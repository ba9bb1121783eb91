"""Which vision messages count, and what becomes of their stamps, covariances and counters: ArduPilot's rules."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.dialect import Encoder, Identity, Reader, make_message
from bridge.wire import FieldValue, Received
from tools.simulate.autopilot.jitter import MESSAGES, MOST_LAG_US, JitterCorrection
from tools.simulate.autopilot.parameters import FOR_VISION, Parameters
from tools.simulate.autopilot.vision import PoseSample, SpeedSample, VisionSensor

FRD: dict[str, FieldValue] = {"frame_id": 20, "child_frame_id": 12, "q": [1.0, 0.0, 0.0, 0.0]}


def received(name: str, **fields: FieldValue) -> Received:
    """Return a message as it comes off the wire."""
    return Reader().feed(Encoder(Identity(1))(make_message(name, 0, **fields), 0))[0]


class Sensor:
    """A sensor with its link's clock; messages arrive when they are stamped, `late_ms` later."""

    def __init__(self, **parameters: float) -> None:
        self.sensor = VisionSensor(Parameters({**FOR_VISION, "VISO_DELAY_MS": 0, **parameters}))
        self.clock = JitterCorrection()

    def take(
        self, name: str, at_ms: float, late_ms: float = 0.0, /, **fields: FieldValue
    ) -> tuple[PoseSample | SpeedSample, ...]:
        stamp = "time_usec" if name in ("ATT_POS_MOCAP", "ODOMETRY") else "usec"
        message = received(name, **{stamp: round(1000 * at_ms), **fields})
        return self.sensor.take(message, round(1000 * (at_ms + late_ms)), self.clock, filter_runs=True)


def pose_of(samples: tuple[PoseSample | SpeedSample, ...]) -> PoseSample:
    (sample,) = (each for each in samples if isinstance(each, PoseSample))
    return sample


@given(st.lists(st.floats(0.0, 0.2), min_size=1, max_size=250), st.integers(-(10**12), 10**12))
def test_a_corrected_stamp_is_never_in_the_future_nor_half_a_second_old(lags_s: list[float], offset_us: int) -> None:
    clock = JitterCorrection()
    for k, lag_s in enumerate(lags_s):
        arrived_us = 10**7 + 66_667 * k + round(1e6 * lag_s)
        corrected_us = clock.corrected_us(10**7 + 66_667 * k + offset_us, arrived_us)
        assert arrived_us - MOST_LAG_US <= corrected_us <= arrived_us


def test_jitter_goes_and_the_least_delay_stays() -> None:
    clock = JitterCorrection()
    errors_us = [clock.corrected_us(66_667 * k, 66_667 * k + 30_000 + 7_000 * (k % 5)) - 66_667 * k for k in range(60)]
    assert set(errors_us) == {30_000}


def test_a_sender_that_becomes_later_for_good_is_followed_after_a_hundred_messages() -> None:
    clock = JitterCorrection()
    for k in range(MESSAGES):
        clock.corrected_us(66_667 * k, 66_667 * k)
    errors_us = [
        clock.corrected_us(66_667 * k, 66_667 * k + 50_000) - 66_667 * k for k in range(MESSAGES, 2 * MESSAGES + 1)
    ]
    assert errors_us[0] == 0
    assert errors_us[-1] == 50_000


def test_samples_less_than_20_ms_apart_are_dropped_whatever_message_brings_them() -> None:
    sensor = Sensor()
    taken = [bool(sensor.take("VISION_POSITION_ESTIMATE", at_ms)) for at_ms in (1000, 1019, 1020, 1039.5, 1041)]
    assert taken == [True, False, True, False, True]
    assert not sensor.take("ATT_POS_MOCAP", 1041, q=[1.0, 0.0, 0.0, 0.0])


def test_a_stamp_that_goes_back_is_taken() -> None:
    sensor = Sensor()
    sensor.take("VISION_POSITION_ESTIMATE", 2000)
    assert pose_of(sensor.take("VISION_POSITION_ESTIMATE", 1900, 100)).t_ms == 1900


@pytest.mark.parametrize("counter", [1, 255, 7])
def test_any_change_of_the_counter_is_a_reset_and_the_first_pose_counts_from_zero(counter: int) -> None:
    sensor = Sensor()
    resets = [
        pose_of(sensor.take("VISION_POSITION_ESTIMATE", at_ms, reset_counter=each)).reset
        for at_ms, each in ((1000, 0), (1100, counter), (1200, counter), (1300, 0))
    ]
    assert resets == [False, True, False, True]


def test_the_sigma_is_the_root_of_the_sum_of_variances_and_no_less_than_the_noise_floor() -> None:
    covariance = [0.0] * 21
    covariance[0] = covariance[6] = covariance[11] = 0.09
    sensor = Sensor(VISO_POS_M_NSE=0.1)
    large = pose_of(sensor.take("VISION_POSITION_ESTIMATE", 1000, covariance=covariance))
    small = pose_of(sensor.take("VISION_POSITION_ESTIMATE", 1100, covariance=[1e-6] * 21))
    unknown = pose_of(sensor.take("VISION_POSITION_ESTIMATE", 1200, covariance=[math.nan] + [1.0] * 20))
    assert large.sigma_m == pytest.approx(0.3 * math.sqrt(3.0), rel=1e-6)
    assert (small.sigma_m, unknown.sigma_m) == (0.1, 0.1)


def test_a_variance_that_is_no_number_beside_the_first_makes_the_sigma_huge_and_is_an_error_of_the_autopilots() -> None:
    sensor = Sensor(VISO_POS_M_NSE=0.1)
    unknown = pose_of(sensor.take("VISION_POSITION_ESTIMATE", 1000, covariance=[math.nan] + [1e-6] * 20))
    assert (unknown.sigma_m, sensor.sensor.met_nan) == (0.1, False)
    covariance = [1e-6] * 21
    covariance[6] = math.nan
    broken = pose_of(sensor.take("VISION_POSITION_ESTIMATE", 1100, covariance=covariance))
    assert broken.sigma_m == pytest.approx(50.05)
    assert sensor.sensor.met_nan


def test_odometry_counts_only_in_local_and_body_frd_and_its_velocity_is_the_bodys() -> None:
    sensor = Sensor()
    half = math.sqrt(0.5)
    east: dict[str, FieldValue] = {**FRD, "q": [half, 0.0, 0.0, half], "vx": 1.0}  # nose to the east, going forward
    pose, speed = sensor.take("ODOMETRY", 1000, **east)
    assert isinstance(pose, PoseSample)
    assert isinstance(speed, SpeedSample)
    assert pose.yaw == pytest.approx(math.pi / 2.0, abs=1e-6)
    assert speed.v_BinN == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    assert not sensor.take("ODOMETRY", 1100, **{**FRD, "frame_id": 1})
    assert not sensor.take("ODOMETRY", 1200, **{**FRD, "child_frame_id": 8})


def test_odometry_of_failed_quality_is_never_used_but_keeps_the_sensor_healthy() -> None:
    sensor = Sensor()
    assert not sensor.take("ODOMETRY", 1000, **FRD, quality=-1)
    assert sensor.sensor.healthy(1200)


def test_it_is_ill_after_300_ms_of_silence() -> None:
    sensor = Sensor()
    sensor.take("VISION_POSITION_ESTIMATE", 1000)
    assert sensor.sensor.healthy(1299)
    assert not sensor.sensor.healthy(1300)


def test_the_delay_parameter_is_taken_off_the_stamp() -> None:
    assert pose_of(Sensor(VISO_DELAY_MS=44).take("VISION_POSITION_ESTIMATE", 1000)).t_ms == 956


def test_without_viso_type_nothing_counts() -> None:
    sensor = Sensor(VISO_TYPE=0)
    assert not sensor.take("VISION_POSITION_ESTIMATE", 1000)
    assert not sensor.sensor.healthy(1001)
