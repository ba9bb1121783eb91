"""Servo pulses to sticks, and the autopilot's clock to ours."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bridge.log.received import NO_TIME
from bridge.settings import load_settings
from bridge.settings.vehicle import ServoSettings, VehicleSettings
from tools.sysid.servo_clock import WRAP_NS, on_stream_clock
from tools.sysid.servos import sticks_of
from tracker.errors import OperatorError

_LAB = load_settings("lab").vehicle


def _vehicle(*servos: dict[str, Any]) -> VehicleSettings:
    assert _LAB is not None
    return _LAB.model_copy(update={"servos": tuple(ServoSettings(trim_us=1500.0, **servo) for servo in servos)})


def test_a_pilots_right_nose_up_and_nose_right_are_turned_about_the_bodys_axes() -> None:
    assert _LAB is not None
    pulses = np.array([[1600.0, 1750.0, 1400.0, 2000.0]])  # right, nose up, up, nose right
    assert sticks_of(pulses, _LAB)[0] == pytest.approx([0.2, -0.5, -1.0, -0.2])


def test_sticks_come_back_through_a_mixing_swash_plate() -> None:
    """Three swash servos 120 deg apart, H3-120, and the tail."""
    vehicle = _vehicle(
        {"channel": 1, "right_us": -300.0, "nose_up_us": 173.0, "up_us": 200.0},
        {"channel": 2, "right_us": 300.0, "nose_up_us": 173.0, "up_us": 200.0},
        {"channel": 3, "nose_up_us": -346.0, "up_us": 200.0},
        {"channel": 4, "nose_right_us": -450.0},
    )
    right, nose_up, nose_right, up = 0.3, -0.4, 0.2, 0.1
    pulses = np.array(
        [
            [
                1500.0 + s.right_us * right + s.nose_up_us * nose_up + s.nose_right_us * nose_right + s.up_us * up
                for s in vehicle.servos
            ]
        ]
    )
    assert sticks_of(pulses, vehicle)[0] == pytest.approx([right, -nose_up, -nose_right, up])


def test_servos_that_do_not_tell_all_sticks_are_refused() -> None:
    vehicle = _vehicle(*({"channel": k, "right_us": 100.0 * k} for k in range(1, 5)))
    with pytest.raises(OperatorError, match=r"do not all follow from these 4 servos"):
        sticks_of(np.full((1, 4), 1500.0), vehicle)


def _clock(t_ns: int, offset_ns: int) -> dict[str, Any]:
    return {"t_ns": t_ns, "offset_ns": offset_ns, "spread_ms": 0.3, "rtt_ms": 1.6}


def test_stamps_go_to_our_clock_by_the_offset_known_when_they_arrived() -> None:
    stamped = np.array([1_000, 2_000, 3_000], dtype=np.int64) * 1_000_000
    arrived = stamped + 500_000_000 + 7_000_000
    times, clock = on_stream_clock(arrived, stamped, [_clock(0, 499_000_000), _clock(2_400_000_000, 500_000_000)])
    assert (times - stamped).tolist() == [
        499_000_000,
        500_000_000 if arrived[1] >= 2_400_000_000 else 499_000_000,
        500_000_000,
    ]
    assert clock.sigma_s == pytest.approx(np.hypot(0.3e-3, 0.4e-3))


def test_a_microsecond_counter_that_starts_anew_goes_on() -> None:
    since_boot = WRAP_NS - 20_000_000 + np.arange(3, dtype=np.int64) * 20_000_000
    arrived = since_boot + 5_000_000
    times, _ = on_stream_clock(arrived, since_boot % WRAP_NS, [_clock(0, 0)])
    assert times.tolist() == since_boot.tolist()


def test_without_timesync_arrival_counts_and_its_uncertainty_is_stated() -> None:
    arrived = np.array([10, 20], dtype=np.int64)
    for stamped, clocks in ((np.array([5, 15]), []), (np.array([NO_TIME, 15]), [_clock(0, 0)])):
        times, clock = on_stream_clock(arrived, stamped.astype(np.int64), clocks)
        assert times.tolist() == arrived.tolist()
        assert clock.sigma_s > 1e-3


def test_an_offset_that_makes_no_sense_is_not_believed() -> None:
    arrived = np.array([10, 20], dtype=np.int64) * 10**9
    times, clock = on_stream_clock(arrived, arrived, [_clock(0, 60 * 10**9)])
    assert times.tolist() == arrived.tolist()
    assert "no sense" in clock.name
