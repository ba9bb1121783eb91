"""The simulator's interfaces: servos to sticks, states to lines, wires with losses."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.ned import rotation_from_room
from tools.simulate.dynamics import GRAVITY
from tools.simulate.helicopter import State, standing
from tools.sitl.aboard import Conditions, running
from tools.sitl.airframe import COLLECTIVE_DEG, COLLECTIVE_PWM, HOVER_DEG, VEHICLE, sticks_of
from tools.sitl.lockstep import line_of
from tools.sitl.process import Wiring, arguments
from tools.sitl.relay import Relay
from tools.sitl.setup import parameter_file
from tools.sitl.wire import UdpWire
from tracker.errors import OperatorError
from tracker.maths import so3

NO_RADIO = (1500,) * 8


def swash(roll: float, pitch: float, collective: float) -> tuple[int, ...]:
    """Return servo outputs as ArduPilot mixes them for an H3-120 plate."""
    pwm = []
    for angle_deg in (-60.0, 60.0, 180.0):
        angle = math.radians(angle_deg)
        share = 0.45 * math.cos(angle + math.pi / 2.0) * roll + 0.45 * math.cos(angle) * pitch + collective
        pwm.append(round(1000 + 1000 * share))
    return (*pwm, 1500, 1500, 1500, 1500, 2000)


@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(0.47, 0.73))
def test_the_sticks_are_the_inverse_of_ardupilots_mixing(roll: float, pitch: float, collective: float) -> None:
    sticks = sticks_of(swash(roll, pitch, collective))
    assert sticks.roll == pytest.approx(roll, abs=3e-3)
    assert sticks.pitch == pytest.approx(-pitch, abs=3e-3)


def test_the_hover_collective_carries_the_weight_and_the_ends_are_the_blades() -> None:
    low_us, high_us = COLLECTIVE_PWM
    low_deg, high_deg = COLLECTIVE_DEG
    hover_us = low_us + (HOVER_DEG - low_deg) / (high_deg - low_deg) * (high_us - low_us)
    lift = [
        1.0 + VEHICLE.collective_share * sticks_of((us, us, us, 1500, 0, 0, 0, 2000)).collective
        for us in (low_us, round(hover_us), high_us)
    ]
    assert lift == pytest.approx([low_deg / HOVER_DEG, 1.0, high_deg / HOVER_DEG], abs=1e-9)


def test_tail_to_the_right_turns_right_and_a_low_motor_channel_stops_the_rotor() -> None:
    assert sticks_of((1500, 1500, 1500, 2000, 0, 0, 0, 1000)).yaw == -1.0
    assert not sticks_of((1500, 1500, 1500, 1500, 0, 0, 0, 1000)).motor


def told(now: State, before: State | None = None, room_yaw: float = 0.0) -> dict[str, object]:
    line = line_of(rotation_from_room(room_yaw), 1.5, before or now, now, 0.001, NO_RADIO)
    assert line.startswith(b"\n")
    assert line.endswith(b"\n")
    message: dict[str, object] = json.loads(line)
    return message


def test_a_standing_vehicle_feels_its_weight_upwards_and_points_where_the_room_does() -> None:
    message = told(standing(VEHICLE, -0.75, (1.0, 0.0)), room_yaw=math.pi / 2.0)
    assert message["imu"] == {"gyro": [0.0, 0.0, 0.0], "accel_body": pytest.approx([0.0, 0.0, -GRAVITY])}
    assert message["position"] == pytest.approx([0.0, 1.0, 0.75 - VEHICLE.skid_m], abs=1e-9)  # x of the room is east
    q = np.array(message["quaternion"])
    assert q == pytest.approx([math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)], abs=1e-9)


def test_speeding_up_forwards_is_felt_forwards_and_a_left_turn_is_a_negative_yaw_rate() -> None:
    still = standing(VEHICLE, -0.75)
    now = State(
        still.p_BinW, so3.exp(np.zeros(3)), np.array([0.002, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), still.cyclic, 0.0
    )
    message = told(now, still)
    imu = message["imu"]
    assert isinstance(imu, dict)
    assert imu["accel_body"] == pytest.approx([2.0, 0.0, -GRAVITY])
    assert imu["gyro"] == pytest.approx([0.0, 0.0, -1.0])


def test_the_simulator_listens_at_no_serial_port() -> None:
    given_ = arguments(Wiring(1, 2, 3, 4), (47.0, 8.0, 400.0))
    ports = [given_[k + 1] for k, each in enumerate(given_) if each.startswith("--serial")]
    assert len(ports) == 5
    assert all(port.startswith(("udpclient:127.0.0.1:", "none:")) for port in ports)


def test_the_parameter_file_holds_the_delay_and_a_value_a_line() -> None:
    lines = parameter_file(42, {"VISO_QUAL_MIN": 1}).splitlines()
    assert "VISO_DELAY_MS 42" in lines
    assert "VISO_QUAL_MIN 1" in lines
    assert all(len(line.split()) == 2 for line in lines)


def test_a_relay_passes_both_ways_and_loses_what_it_shall() -> None:
    autopilot = UdpWire()
    relay = Relay(UdpWire(("127.0.0.1", autopilot.port)), seed=3)
    bridge = UdpWire(("127.0.0.1", relay.bridge_port))
    try:
        bridge.send(b"pose")
        relay.pump()
        assert autopilot.receive() == [b"pose"]
        autopilot.send(b"heartbeat")
        relay.pump()
        assert bridge.receive() == [b"heartbeat"]
        relay.loss = 0.3
        for _ in range(200):
            bridge.send(b"pose")
            relay.pump()
        assert len(autopilot.receive()) + relay.lost == 200
        assert 30 <= relay.lost <= 90
    finally:
        for each in (bridge, relay, autopilot):
            each.close()


def test_a_simulator_that_is_not_there_is_told_in_one_line_with_the_file_to_start_it_with(tmp_path: Path) -> None:
    given_ = Conditions(0.0, (47.0, 8.0, 400.0), 30, 10**9)
    complaint = r"nobody listens at tcp:127\.0\.0\.1:1 .*--defaults (/.*vision\.parm)"
    with pytest.raises(OperatorError, match=complaint):
        running("tcp:127.0.0.1:1", tmp_path, given_, lambda: NO_RADIO)
    assert (tmp_path / "vision.parm").read_text() == parameter_file(30, {})
