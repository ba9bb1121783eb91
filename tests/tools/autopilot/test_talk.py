"""What the simulated autopilot says and answers: as a real one does, measured in ArduPilot's SITL."""

from __future__ import annotations

import pytest

from tests.tools.autopilot.conversation import Conversation
from tools.simulate.autopilot.parameters import FOR_VISION

ACCEPTED, UNSUPPORTED, FAILED = 0, 3, 4
ARM, REBOOT, SET_INTERVAL = 400, 246, 511
SERVOS, RADIO, BATTERY = 36, 65, 147
LOCAL_POSITION, EKF_STATUS, ORIGIN, GLOBAL_POSITION, VERSION = 32, 193, 49, 33, 148


def ready(talk: Conversation, until_s: float = 8.0) -> None:
    """Bring it to where it may arm."""
    talk.wait(4.5)
    assert talk.set_origin() == ACCEPTED
    talk.wait(until_s, vision=True)


def test_its_heartbeat_comes_once_a_second_and_says_who_it_is() -> None:
    with Conversation() as talk:
        talk.say("HEARTBEAT")
        talk.wait(5.0)
        beats = [each for each in talk.heard if each.message == "HEARTBEAT"]
    assert 5 <= len(beats) <= 6
    assert {(each.system_id, each.component_id) for each in beats} == {(1, 1)}
    assert {(each.fields["type"], each.fields["autopilot"]) for each in beats} == {(4, 3)}


def test_a_timesync_request_is_answered_in_its_own_time_since_boot_and_it_asks_itself() -> None:
    with Conversation() as talk:
        talk.wait(1.0)
        talk.say("TIMESYNC", tc1=0, ts1=42)
        talk.wait(21.0)
        answers = [each.fields for each in talk.heard if each.message == "TIMESYNC"]
    assert [each["tc1"] for each in answers if each["ts1"] == 42] == [1_020_000_000]
    assert sum(each["tc1"] == 0 for each in answers) == 2


@pytest.mark.parametrize(("at_s", "result"), [(2.0, FAILED), (4.0, ACCEPTED), (4.5, ACCEPTED)])
def test_an_origin_is_taken_only_once_the_filter_has_memory(at_s: float, result: int) -> None:
    with Conversation() as talk:
        talk.wait(at_s)
        assert talk.set_origin() == result


def test_an_origin_given_before_the_filter_runs_is_acknowledged_and_lost_for_good() -> None:
    with Conversation() as talk:
        talk.wait(3.8)
        assert talk.set_origin() == ACCEPTED
        assert talk.request(ORIGIN, "GPS_GLOBAL_ORIGIN")["latitude"] == 473_978_000
        talk.wait(8.0, vision=True)
        assert talk.set_origin() == FAILED
        assert talk.request(GLOBAL_POSITION, "GLOBAL_POSITION_INT")["lat"] == 0
        assert talk.command(ARM, 1) == ACCEPTED
        assert talk.command(22, 0, 0, 0, 0, 0, 0, 2.0) == FAILED


def test_a_second_origin_and_one_of_zeros_are_refused() -> None:
    with Conversation() as talk:
        talk.wait(4.5)
        assert talk.set_origin(0, 0) == FAILED
        assert talk.set_origin() == ACCEPTED
        assert talk.set_origin(1, 1) == FAILED
        talk.wait(7.0, vision=True)
        assert talk.request(GLOBAL_POSITION, "GLOBAL_POSITION_INT")["lat"] == 473_978_000


def test_the_old_origin_message_is_answered_by_the_origin_or_by_silence() -> None:
    with Conversation() as talk:
        for _ in range(2):
            talk.wait(talk.now_ns / 1e9 + 4.5)
            talk.say("SET_GPS_GLOBAL_ORIGIN", target_system=1, latitude=1, longitude=2, altitude=3)
            talk.tick()
        answers = [each.fields for each in talk.heard if each.message == "GPS_GLOBAL_ORIGIN"]
    assert [(each["latitude"], each["longitude"], each["altitude"]) for each in answers] == [(1, 2, 3)]


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"GPS1_TYPE": 1}, "Arm: GPS 1: Bad fix"),
        ({"EK3_SRC1_VELXY": 3}, "Arm: AHRS: EK3 sources require GPS"),
        ({"EK3_SRC1_YAW": 1}, "Arm: AHRS: EK3 sources require Compass"),
        ({"VISO_TYPE": 0}, "Arm: AHRS: EK3 sources require VisualOdom"),
    ],
)
def test_it_does_not_arm_with_a_wrong_parameter_and_says_why(change: dict[str, float], text: str) -> None:
    with Conversation({**FOR_VISION, **change}) as talk:
        ready(talk)
        assert talk.command(ARM, 1) == FAILED
        assert text in talk.texts()


def test_it_arms_with_origin_and_vision_and_not_without() -> None:
    with Conversation() as talk:
        talk.wait(7.0, vision=True)
        assert talk.command(ARM, 1) == FAILED
        assert "Arm: AHRS: waiting for home" in talk.texts()
        assert talk.set_origin() == ACCEPTED
        talk.wait(8.0)
        assert talk.command(ARM, 1) == FAILED
        assert talk.texts()[-1] == "Arm: VisOdom: not healthy"
        talk.wait(8.5, vision=True)
        assert talk.command(ARM, 1) == ACCEPTED


def test_its_flags_tell_the_filters_start_and_not_whether_it_has_an_origin() -> None:
    flags = []
    with Conversation() as talk:
        for until_s, vision in ((3.0, False), (5.0, False), (7.0, False), (9.0, True)):
            talk.wait(until_s, vision)
            flags.append(talk.request(EKF_STATUS, "EKF_STATUS_REPORT")["flags"])
    assert flags == [0x400, 0x0, 0xA7, 0x33F]


def test_while_it_may_not_arm_it_says_so_every_half_minute() -> None:
    with Conversation() as talk:
        talk.say("HEARTBEAT")
        talk.wait(62.0)
        assert talk.texts().count("PreArm: VisOdom: not healthy") == 2


def test_every_parameter_is_listed_with_its_place_and_one_can_be_read_and_set() -> None:
    with Conversation() as talk:
        talk.say("PARAM_REQUEST_LIST", target_system=1, target_component=1)
        talk.tick()
        listed = [each.fields for each in talk.heard if each.message == "PARAM_VALUE"]
        talk.say("PARAM_SET", target_system=1, target_component=1, param_id="VISO_DELAY_MS", param_value=44.4)
        talk.say("PARAM_REQUEST_READ", target_system=1, target_component=1, param_id="VISO_DELAY_MS", param_index=-1)
        talk.say("PARAM_REQUEST_READ", target_system=1, target_component=1, param_id="NO_SUCH_NAME", param_index=-1)
        talk.tick()
        values = [each.fields["param_value"] for each in talk.heard if each.message == "PARAM_VALUE"][len(listed) :]
    assert [each["param_index"] for each in listed] == list(range(len(listed)))
    assert {each["param_count"] for each in listed} == {len(listed)}
    assert values == [44.0, 44.0]


def test_what_is_meant_for_another_system_is_not_answered() -> None:
    with Conversation() as talk:
        talk.say("PARAM_REQUEST_LIST", target_system=2, target_component=1)
        talk.tick()
    assert not [each for each in talk.heard if each.message == "PARAM_VALUE"]


def test_a_message_comes_at_the_rate_asked_for_until_it_is_stopped() -> None:
    with Conversation() as talk:
        ready(talk)
        assert talk.command(SET_INTERVAL, LOCAL_POSITION, 100_000) == ACCEPTED
        talk.wait(10.1, vision=True)
        count = sum(each.message == "LOCAL_POSITION_NED" for each in talk.heard)
        assert talk.command(SET_INTERVAL, LOCAL_POSITION, -1) == ACCEPTED
        talk.wait(11.0, vision=True)
        later = sum(each.message == "LOCAL_POSITION_NED" for each in talk.heard)
        assert talk.command(SET_INTERVAL, 12345, 100_000) == FAILED
    assert 20 <= count <= 22
    assert later <= count + 1


def test_servos_and_radio_are_told_and_a_battery_it_does_not_have_is_known_and_silent() -> None:
    with Conversation() as talk:
        for number in (SERVOS, RADIO, BATTERY):
            assert talk.command(SET_INTERVAL, number, 20_000) == ACCEPTED
        talk.wait(2.0)
        servos = [each.fields for each in talk.heard if each.message == "SERVO_OUTPUT_RAW"]
        kinds = {each.message for each in talk.heard}
    assert len(servos) > 40
    assert {name: servos[-1][name] for name in ("servo1_raw", "servo3_raw", "servo9_raw")} == {
        "servo1_raw": 1500, "servo3_raw": 1500, "servo9_raw": 0,
    }  # fmt: skip
    assert "RC_CHANNELS" in kinds
    assert "BATTERY_STATUS" not in kinds


def test_its_version_can_be_asked_and_an_unknown_command_is_called_unsupported() -> None:
    with Conversation() as talk:
        assert int(str(talk.request(VERSION, "AUTOPILOT_VERSION")["flight_sw_version"])) >> 24 == 4
        assert talk.command(31_999) == UNSUPPORTED


def test_after_a_reboot_it_wants_its_origin_again_and_still_knows_its_parameters() -> None:
    with Conversation() as talk:
        ready(talk)
        talk.say("PARAM_SET", target_system=1, target_component=1, param_id="VISO_DELAY_MS", param_value=77.0)
        assert talk.command(REBOOT, 1) == ACCEPTED
        assert talk.autopilot.navigation.answered_origin is None
        assert talk.autopilot.parameters["VISO_DELAY_MS"] == 77
        talk.wait(talk.now_ns / 1e9 + 4.5)
        assert talk.set_origin() == ACCEPTED
