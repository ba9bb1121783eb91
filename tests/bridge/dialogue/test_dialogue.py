"""One link's talk: who counts as the autopilot, what it is sent, what is held back, what the pilot hears."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest

from bridge.dialogue import PROFILES, Dialogue, Origin, Terms
from bridge.dialogue.news import Facts, News
from bridge.dialogue.origin import OriginState
from bridge.dialogue.peer import Autopilot
from bridge.dialogue.streams import Wanted
from bridge.wire import Message
from tests.bridge.dialogue.far_autopilot import BASE_NS, beat, from_autopilot, reply
from tests.bridge.estimates import estimate
from tracker.types import TrackState

PLACE = Origin(32.1, 34.8, 30.0)
FREE = Terms()
POSE, SPEED, MOCAP = "VISION_POSITION_ESTIMATE", "VISION_SPEED_ESTIMATE", "ATT_POS_MOCAP"


def met(kind: str, terms: Terms = FREE) -> Dialogue:
    """Return a talk in which an autopilot was heard."""
    dialogue = Dialogue(terms)
    dialogue.take([beat(BASE_NS, system_id=3, kind=kind)])
    return dialogue


def texts(messages: list[Message]) -> list[object]:
    return [message.fields["text"] for message in messages if message.name == "STATUSTEXT"]


@pytest.mark.parametrize(
    ("kind", "messages"),
    [
        ("ARDUPILOTMEGA", (POSE, SPEED)),
        ("PX4", ("ODOMETRY",)),
        ("GENERIC", (POSE, MOCAP)),
    ],
)
def test_the_heartbeat_chooses_the_profile(kind: str, messages: tuple[str, ...]) -> None:
    assert Dialogue(Terms()).messages == (POSE, MOCAP)
    assert met(kind).messages == messages


def test_the_config_overrules_heartbeat_and_profile() -> None:
    assert met("PX4", Terms(profile="ardupilot")).messages == (POSE, SPEED)
    assert met("PX4", Terms(messages=(MOCAP,))).messages == (MOCAP,)


def test_no_profile_for_ardupilot_mixes_a_message_with_a_reset_counter_and_one_without() -> None:
    assert MOCAP not in PROFILES["ardupilot"].messages
    dialogue = met("ARDUPILOTMEGA", Terms(messages=(POSE, MOCAP)))
    assert dialogue.messages == (POSE,)
    assert met("ARDUPILOTMEGA", Terms(messages=(MOCAP,))).messages == (MOCAP,)


def test_only_the_first_autopilot_counts() -> None:
    dialogue = met("ARDUPILOTMEGA")
    assert dialogue.peer is not None
    assert (dialogue.peer.system_id, dialogue.peer.autopilot) == (3, Autopilot.ARDUPILOT)
    dialogue.take([beat(BASE_NS + 1, system_id=4, kind="PX4")])
    assert dialogue.peer.system_id == 3
    assert "posebridge: autopilot 4 ignored" in texts(dialogue.due(TrackState.TRACKING, BASE_NS + 2))
    dialogue.take([from_autopilot("GPS_GLOBAL_ORIGIN", BASE_NS + 3, system_id=4, latitude=1, longitude=1)])
    assert dialogue.state(BASE_NS + 3).strangers == 2


def test_a_ground_station_and_our_own_echo_are_no_autopilot() -> None:
    dialogue = Dialogue(Terms())
    dialogue.take(
        [replace(beat(BASE_NS), system_id=255), beat(BASE_NS, component_id=197), beat(BASE_NS, kind="INVALID")]
    )
    assert dialogue.peer is None


def test_the_vehicles_id_in_the_config_is_the_only_one_listened_to() -> None:
    dialogue = met("PX4", Terms(vehicle_id=9))
    assert dialogue.peer is None
    dialogue.take([beat(BASE_NS, system_id=9, kind="PX4")])
    assert dialogue.peer is not None


def test_with_ardupilot_no_pose_goes_before_the_origin() -> None:
    dialogue = met("ARDUPILOTMEGA", Terms(origin=PLACE))
    pose = estimate(t_ns=BASE_NS)
    assert not dialogue.admits(pose, BASE_NS)
    assert dialogue.state(BASE_NS).holding.startswith("origin: ")
    dialogue.take(
        [from_autopilot("GPS_GLOBAL_ORIGIN", BASE_NS, system_id=3, latitude=321_000_000, longitude=348_000_000)]
    )
    assert dialogue.admits(pose, BASE_NS)
    assert dialogue.state(BASE_NS).holding == ""


def test_poses_follow_each_other_no_closer_than_the_profile_says() -> None:
    """ArduPilot's EKF3 drops samples less than 20 ms apart: of 60 a second 30 go, of 48 all."""
    for rate_hz, share in ((60, 0.5), (48, 1.0), (100, 0.5), (15, 1.0)):
        dialogue = met("ARDUPILOTMEGA")
        times = [BASE_NS + k * 1_000_000_000 // rate_hz for k in range(rate_hz)]
        went = [t_ns for t_ns in times if dialogue.admits(estimate(t_ns=t_ns), t_ns)]
        assert len(went) == pytest.approx(share * rate_hz, abs=1)
        assert min(b - a for a, b in itertools.pairwise(went)) >= 20_000_000
        assert dialogue.state(times[-1]).too_close == rate_hz - len(went)


def test_an_estimate_too_old_is_never_sent() -> None:
    dialogue = met("PX4", Terms(max_age_ns=50_000_000))
    assert dialogue.admits(estimate(t_ns=BASE_NS), BASE_NS + 50_000_000)
    assert not dialogue.admits(estimate(t_ns=2 * BASE_NS), 2 * BASE_NS + 50_000_001)
    assert dialogue.state(BASE_NS).too_old == 1


def test_nothing_is_asked_of_a_silent_line() -> None:
    dialogue = Dialogue(Terms(origin=PLACE))
    sent = [m.name for k in range(100) for m in dialogue.due(TrackState.LOST, BASE_NS + k * 50_000_000)]
    assert set(sent) == {"HEARTBEAT"}


def test_the_pilot_hears_of_a_change_once() -> None:
    dialogue = met("PX4")
    said: list[object] = []
    for k in range(200):
        now_ns = BASE_NS + k * 50_000_000
        track = TrackState.LOST if 60 <= k < 120 else TrackState.TRACKING
        dialogue.take([beat(now_ns, system_id=3, kind="PX4")])
        said += texts(dialogue.due(track, now_ns))
    assert said == ["posebridge: track tracking", "posebridge: track lost", "posebridge: track tracking"]
    assert all(len(str(text)) <= 50 for text in said)


def test_poses_that_come_too_old_are_told_once_and_so_is_their_return() -> None:
    dialogue = met("PX4")
    said: list[object] = []
    for k in range(200):
        now_ns = BASE_NS + k * 20_000_000
        dialogue.take([beat(now_ns, system_id=3, kind="PX4")])
        dialogue.admits(estimate(t_ns=now_ns - (150_000_000 if 60 <= k < 120 else 0)), now_ns)
        said += texts(dialogue.due(TrackState.TRACKING, now_ns))
    assert said == [
        "posebridge: track tracking", "posebridge: poses too old, none sent", "posebridge: poses in time again",
    ]  # fmt: skip


def test_an_autopilot_that_falls_silent_and_comes_back_is_told_of_once_each() -> None:
    dialogue = met("PX4")
    said: list[object] = []
    for k in range(200):
        now_ns = BASE_NS + k * 50_000_000
        if k >= 120:
            dialogue.take([beat(now_ns, system_id=3, kind="PX4")])
        said += texts(dialogue.due(TrackState.TRACKING, now_ns))
    assert said[1:] == ["posebridge: autopilot silent", "posebridge: autopilot heard again"]


def test_a_link_that_is_full_for_long_is_told_of_and_a_single_stall_is_not() -> None:
    dialogue = met("PX4")
    said: list[object] = []
    superseded = 0
    for k in range(400):
        superseded += k == 20 or 100 <= k < 200
        said += texts(dialogue.due(TrackState.TRACKING, BASE_NS + k * 50_000_000, superseded))
    assert said.count("posebridge: link full, rate reduced") == 1
    assert said.count("posebridge: link free again") == 1
    early = [text for k in range(80) for text in texts(met("PX4").due(TrackState.TRACKING, BASE_NS + k, k == 20))]
    assert not any("link" in str(text) for text in early)


def test_a_step_of_the_autopilots_clock_is_told_each_time_it_happens() -> None:
    dialogue = met("PX4")
    said: list[object] = []
    far_ns = 90_000_000_000
    for k in range(60):
        now_ns = BASE_NS + k * 1_000_000_000
        far_ns += 1_000_000_000 + (k in (20, 40)) * 5_000_000_000
        due = dialogue.due(TrackState.TRACKING, now_ns)
        said += texts(due)
        dialogue.take([replace(reply(m, now_ns + 2_000_000, far_ns), system_id=3) for m in due if m.name == "TIMESYNC"])
    stepped = [text for text in said if "clock" in str(text)]
    assert stepped == ["posebridge: autopilot clock stepped (1)", "posebridge: autopilot clock stepped (2)"]


def test_no_text_is_cut_by_the_fifty_bytes_that_statustext_holds() -> None:
    news = News()
    facts = Facts(TrackState.TRACKING, True, True, True, 99, 254, OriginState.REFUSED)
    well = replace(facts, late=False, away=False, saturated=False, track=TrackState.SEARCHING)
    for k, each in enumerate((facts, well)):
        for text in texts(news.due(each, BASE_NS + k * 2_000_000_000)):
            assert len(str(text).encode()) <= 50


def test_a_reboot_of_the_autopilot_starts_the_matter_of_the_origin_anew() -> None:
    dialogue = met("ARDUPILOTMEGA", Terms(origin=PLACE))
    dialogue.take(
        [from_autopilot("GPS_GLOBAL_ORIGIN", BASE_NS, system_id=3, latitude=321_000_000, longitude=348_000_000)]
    )
    now_ns = BASE_NS
    for far_ns in (90_000_000_000, 91_000_000_000, 1_500_000_000):
        now_ns += 1_000_000_000
        (request,) = (m for m in dialogue.due(TrackState.TRACKING, now_ns) if m.name == "TIMESYNC")
        answer = reply(request, now_ns + 2_000_000, far_ns)
        dialogue.take([replace(answer, system_id=3)])
    assert not dialogue.admits(estimate(t_ns=now_ns), now_ns)


def test_what_is_known_of_the_far_end_is_told_in_a_line_and_in_a_word() -> None:
    assert str(Dialogue(Terms()).state(BASE_NS)) == "no autopilot heard"
    dialogue = met("ARDUPILOTMEGA", Terms(origin=PLACE))
    waiting = dialogue.state(BASE_NS)
    assert waiting.brief == "ArduPilot, NO POSES, origin: asking the autopilot whether it has one"
    assert str(waiting).startswith("ArduPilot, system 3, profile ardupilot, origin asking")
    dialogue.take(
        [from_autopilot("GPS_GLOBAL_ORIGIN", BASE_NS, system_id=3, latitude=321_000_000, longitude=348_000_000)]
    )
    now_ns = BASE_NS + 1_000_000_000
    (request,) = (m for m in dialogue.due(TrackState.TRACKING, now_ns) if m.name == "TIMESYNC")
    dialogue.take([replace(reply(request, now_ns + 4_000_000, 1_002_000_000), system_id=3)])
    assert not dialogue.admits(estimate(t_ns=0), now_ns)
    assert str(dialogue.state(now_ns)) == (
        "ArduPilot, system 3, profile ardupilot, origin set, clock +5000.0 +- 0.0 ms, settling, round trip 4.0 ms, "
        "1 too old"
    )
    assert dialogue.state(now_ns + 5_000_000_000).brief == "ArduPilot SILENT"


def test_a_full_link_and_what_was_asked_for_stand_in_the_far_ends_line() -> None:
    dialogue = met("PX4", Terms(streams=Wanted(50.0, 5760.0)))
    for k in range(40):
        dialogue.due(TrackState.TRACKING, BASE_NS + k * 20_000_000, superseded=k)
    state = dialogue.state(BASE_NS)
    assert state.full
    assert state.brief == "PX4, LINK FULL"
    assert "LINK FULL: only the newest poses go, at the rate that fits" in str(state)
    assert "its streams: 0 of 6 at" in str(state)
    assert "all that the line has room for" in str(state)


@pytest.mark.parametrize(
    ("kind", "asked", "by_arrival"), [("PX4", 499, True), ("PX4", 500, False), ("GENERIC", 0, False)]
)
def test_a_px4_counts_poses_as_of_their_arrival_until_it_has_had_500_answers(
    kind: str, asked: int, by_arrival: bool
) -> None:
    dialogue = met(kind)
    questions = [from_autopilot("TIMESYNC", BASE_NS + k, system_id=3, tc1=0, ts1=1 + k) for k in range(asked)]
    dialogue.take(questions)
    state = dialogue.state(BASE_NS + 1000)
    assert state.by_arrival is by_arrival
    assert ("as of their arrival" in str(state)) is by_arrival
