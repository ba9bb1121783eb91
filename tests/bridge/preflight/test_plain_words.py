"""What autopilots say, in plain words: texts as ArduPilot's and PX4's sources have them."""

from __future__ import annotations

import pytest

from bridge.preflight.plain_words import Weight, explain


@pytest.mark.parametrize(
    ("text", "weight", "said"),
    [
        ("PreArm: VisOdom: not healthy", Weight.BLOCKS, "no poses"),
        ("Arm: VisOdom: not healthy", Weight.BLOCKS, "no poses"),
        ("PreArm: AHRS: EK3 sources require GPS", Weight.BLOCKS, "GPS"),
        ("PreArm: AHRS: EK3 sources require VisualOdom", Weight.BLOCKS, "vision is off"),
        ("PreArm: AHRS: EK3 sources require Compass", Weight.BLOCKS, "a sensor that is not there"),
        ("PreArm: Check EK3_SRC1_YAW", Weight.BLOCKS, "does not know"),
        ("AHRS: waiting for home", Weight.BLOCKS, "where on Earth"),
        ("EKF3 IMU0 origin already set", Weight.BLOCKS, "refused"),
        ("PreArm: GPS 1: Bad fix", Weight.BLOCKS, "GPS"),
        ("PreArm: Need Position Estimate", Weight.BLOCKS, "no position yet"),
        ("EKF variance", Weight.BLOCKS, "contradict"),
        ("EKF Failsafe: changed to LAND Mode", Weight.BLOCKS, "contradict"),
        ("EKF Failsafe Cleared", Weight.GOOD, "over"),
        ("EKF3 IMU0 stopped aiding", Weight.BLOCKS, "lost the position"),
        ("PreArm: AHRS: EKF3 Yaw inconsistent 43 deg. Wait or reboot", Weight.BLOCKS, "disagree"),
        ("PreArm: Compass not healthy", Weight.BLOCKS, "compass"),
        ("Arm: Gyros inconsistent", Weight.BLOCKS, "inertial sensors"),
        ("Preflight Fail: ekf2 missing data", Weight.BLOCKS, "has not started"),
        ("Preflight Fail: heading estimate not stable", Weight.BLOCKS, "yaw from vision"),
        ("Preflight Fail: horizontal velocity unstable", Weight.BLOCKS, "disagree"),
        ("EKF3 lane switch 1", Weight.DOUBT, "another of its filters"),
        ("EKF3 IMU0 yaw aligned", Weight.GOOD, "has a yaw"),
        ("EKF3 IMU0 is using external nav data", Weight.GOOD, "uses the bridge's poses"),
        ("EKF3 IMU0 tilt alignment complete", Weight.GOOD, "which way is down"),
        ("EKF3 IMU0 origin set", Weight.GOOD, "has an origin"),
        ("EKF3 IMU0 initialised", Weight.GOOD, "has started"),
    ],
)
def test_a_text_is_said_in_plain_words(text: str, weight: Weight, said: str) -> None:
    meaning = explain(text)
    assert meaning is not None
    assert meaning.weight is weight
    assert said in meaning.meaning


def test_what_keeps_it_from_flying_comes_with_cause_and_remedy() -> None:
    blocking = explain("PreArm: VisOdom: not healthy")
    assert blocking is not None
    assert "300 ms" in blocking.cause
    assert "VISO_TYPE 1" in blocking.remedy


@pytest.mark.parametrize("text", ["ArduCopter V4.7.0", "Frame: HELI", "posebridge: track tracking", ""])
def test_a_text_about_something_else_is_left_alone(text: str) -> None:
    assert explain(text) is None
