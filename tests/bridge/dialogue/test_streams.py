"""What the autopilot is asked to tell: all of it, at a rate that the line carries, and what came of the asking."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.dialect import enum, frame_bytes, message_id
from bridge.dialogue import Dialogue, Terms
from bridge.dialogue.peer import Autopilot, Peer
from bridge.dialogue.streams import ANSWER_NS, REST_NS, StreamKeeper, Wanted
from bridge.links import line_bytes_s
from bridge.wire import Message
from tests.bridge.dialogue.far_autopilot import BASE_NS, beat, from_autopilot
from tracker.types import TrackState

PEER = Peer(1, 1, Autopilot.ARDUPILOT)
ALL = ("SERVO_OUTPUT_RAW", "RC_CHANNELS", "ATTITUDE", "LOCAL_POSITION_NED", "BATTERY_STATUS", "RAW_IMU")
ACCEPTED, DENIED, IN_PROGRESS = 0, 2, 5


def acknowledge(keeper: StreamKeeper, now_ns: int, result: int = ACCEPTED) -> None:
    command = enum("MAV_CMD_SET_MESSAGE_INTERVAL")
    keeper.take(from_autopilot("COMMAND_ACK", now_ns, command=command, result=result))


def asked(keeper: StreamKeeper, results: dict[str, int] | None = None) -> list[tuple[str, float]]:
    """Let it ask for all, answering each; return the messages in their order and the rates [Hz]."""
    names = {message_id(name): name for name in (*ALL, "HIGHRES_IMU", "SCALED_IMU")}
    told, now_ns = [], BASE_NS
    while (question := keeper.due(PEER, now_ns)) is not None:
        name = names[round(float(str(question.fields["param1"])))]
        told.append((name, 1e6 / float(str(question.fields["param2"]))))
        now_ns += 30_000_000
        acknowledge(keeper, now_ns, (results or {}).get(name, ACCEPTED))
    return told


@pytest.mark.parametrize("link", ["udpout:127.0.0.1:14550", "tcp:127.0.0.1:5760", "serial:/dev/ttyAMA0:921600"])
def test_where_the_link_has_room_all_is_asked_for_at_the_full_rate(link: str) -> None:
    keeper = StreamKeeper(Wanted(50.0, line_bytes_s(link)))
    questions = asked(keeper)
    assert [name for name, _ in questions] == list(ALL)
    assert [hz for _, hz in questions] == pytest.approx([50.0] * len(ALL))
    assert str(keeper) == "6 of 6 at 50 Hz"


def test_at_57600_baud_it_is_as_much_as_fits_and_that_is_said() -> None:
    keeper = StreamKeeper(Wanted(50.0, line_bytes_s("serial:/dev/ttyUSB0:57600")))
    rates = dict(asked(keeper))
    assert rates["BATTERY_STATUS"] == pytest.approx(2.0)
    assert rates["ATTITUDE"] == pytest.approx(12.27, abs=0.01)
    assert str(keeper) == "6 of 6 at 12.3 Hz of 50, all that the line has room for"


@given(baud=st.integers(19_200, 3_000_000), rate_hz=st.floats(1.0, 400.0), kind=st.sampled_from(list(Autopilot)))
def test_what_is_asked_for_takes_no_more_than_half_of_a_line(baud: int, rate_hz: float, kind: Autopilot) -> None:
    rates = Wanted(rate_hz, baud / 10).rates_hz(kind)
    assert sum(hz * frame_bytes(name) for name, hz in rates.items()) <= 0.5 * baud / 10 * 1.000001
    assert all(0.0 < hz <= rate_hz for hz in rates.values())


@pytest.mark.parametrize(
    ("kind", "imu"),
    [(Autopilot.ARDUPILOT, "RAW_IMU"), (Autopilot.PX4, "HIGHRES_IMU"), (Autopilot.OTHER, "SCALED_IMU")],
)
def test_each_kind_of_autopilot_is_asked_for_the_imu_message_it_has(kind: Autopilot, imu: str) -> None:
    assert imu in Wanted(50.0).rates_hz(kind)


def test_what_is_refused_is_told_and_not_asked_for_again() -> None:
    keeper = StreamKeeper(Wanted(50.0))
    asked(keeper, {"BATTERY_STATUS": DENIED})
    assert str(keeper) == "5 of 6 at 50 Hz, BATTERY_STATUS refused"
    later = BASE_NS + 2 * REST_NS
    question = keeper.due(PEER, later)
    assert question is not None  # the others do not come
    assert round(float(str(question.fields["param1"]))) != message_id("BATTERY_STATUS")


def test_an_autopilot_that_does_not_answer_is_asked_three_times_for_each_and_that_is_told() -> None:
    keeper = StreamKeeper(Wanted(50.0))
    questions: list[Message] = []
    for k in range(270):
        question = keeper.due(PEER, BASE_NS + k * ANSWER_NS // 10)
        questions += [] if question is None else [question]
    assert len(questions) == 3 * len(ALL)
    assert keeper.settled
    assert str(keeper).startswith("0 of 6 at 50 Hz, SERVO_OUTPUT_RAW not answered")


def test_an_answer_that_says_wait_is_no_answer() -> None:
    keeper = StreamKeeper(Wanted(50.0))
    keeper.due(PEER, BASE_NS)
    acknowledge(keeper, BASE_NS + 1, IN_PROGRESS)
    assert keeper.due(PEER, BASE_NS + 2) is None
    assert str(keeper).startswith("0 of 6")


def test_a_stream_that_stops_is_asked_for_again_and_those_that_come_are_not() -> None:
    keeper = StreamKeeper(Wanted(50.0))
    asked(keeper)
    later = BASE_NS + 2 * REST_NS
    for name in ALL[1:]:
        keeper.take(from_autopilot(name, later - 1))
    question = keeper.due(PEER, later)
    assert question is not None
    assert round(float(str(question.fields["param1"]))) == message_id(ALL[0])
    acknowledge(keeper, later + 1)
    assert keeper.due(PEER, later + 2) is None


def test_after_a_reboot_all_is_asked_for_anew() -> None:
    keeper = StreamKeeper(Wanted(50.0))
    asked(keeper)
    keeper.start_anew()
    assert [name for name, _ in asked(keeper)] == list(ALL)


def test_a_bridge_that_keeps_no_log_asks_for_the_attitude_alone() -> None:
    """The yaw watch needs that, at its own rate."""
    for terms, names in ((Terms(), {"ATTITUDE"}), (Terms(streams=Wanted(50.0)), set(ALL))):
        dialogue = Dialogue(terms)
        dialogue.take([beat(BASE_NS)])
        numbers: set[int] = set()
        for k in range(100):
            now_ns = BASE_NS + k * 40_000_000
            commands = [m for m in dialogue.due(TrackState.TRACKING, now_ns) if m.name == "COMMAND_LONG"]
            wanted = [m for m in commands if m.fields["command"] == enum("MAV_CMD_SET_MESSAGE_INTERVAL")]
            numbers |= {round(float(str(m.fields["param1"]))) for m in wanted}
            command = enum("MAV_CMD_SET_MESSAGE_INTERVAL")
            dialogue.take([from_autopilot("COMMAND_ACK", now_ns + 1, command=command, result=ACCEPTED) for _ in wanted])
        assert numbers == {message_id(name) for name in names}
        assert dialogue.state(BASE_NS).streams == ("" if names == {"ATTITUDE"} else "6 of 6 at 50 Hz")


def test_the_yaw_watch_does_not_slow_down_the_attitude_that_the_log_wants() -> None:
    """ArduPilot sends no ATTITUDE while its EKF does not stand; asked again meanwhile, it must not be for less."""
    dialogue = Dialogue(Terms(streams=Wanted(50.0)))
    dialogue.take([beat(BASE_NS)])
    intervals_us: list[float] = []
    for k in range(400):
        now_ns = BASE_NS + k * 40_000_000
        for message in dialogue.due(TrackState.TRACKING, now_ns):
            if message.name == "COMMAND_LONG" and message.fields["command"] == enum("MAV_CMD_SET_MESSAGE_INTERVAL"):
                command = message.fields["command"]
                dialogue.take([from_autopilot("COMMAND_ACK", now_ns + 1, command=command, result=ACCEPTED)])
                if message.fields["param1"] == float(message_id("ATTITUDE")):
                    intervals_us.append(float(str(message.fields["param2"])))
    assert len(intervals_us) > 2
    assert set(intervals_us) == {20_000.0}
