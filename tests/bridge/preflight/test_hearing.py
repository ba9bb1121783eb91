"""What is heard of an autopilot, asked of it, and made of its words."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from bridge.dialogue import DialogueState
from bridge.dialogue.origin import OriginState
from bridge.dialogue.peer import Autopilot, Peer
from bridge.dialogue.timesync import SyncState
from bridge.preflight.clockwork import our_times
from bridge.preflight.far_end import who_lines
from bridge.preflight.fusion import fusion_lines
from bridge.preflight.hearing import Hearing
from bridge.preflight.poses import Pose
from bridge.preflight.requests import ATTITUDE, POSITION, Requests, rates
from bridge.preflight.verdict import Line, Mark
from bridge.wire import Message, Received
from tests.bridge.dialogue.far_autopilot import beat, from_autopilot
from tracker.types import Array

HELI = Peer(1, 1, Autopilot.ARDUPILOT)
SECOND_NS = 1_000_000_000
SYNC = SyncState(2 * SECOND_NS, 0.0, 4.0, 0.2, 600, 0, 0)
STATE = DialogueState(HELI, False, "ardupilot", SYNC, str(OriginState.SET), "", 0, 0, 0)
STATUS = "EKF_STATUS_REPORT"


def heard(*messages: Received) -> Hearing:
    """Return a hearing that took these messages."""
    hearing = Hearing((POSITION, ATTITUDE, STATUS, "COMMAND_ACK"))
    for message in messages:
        hearing.take(message, HELI)
    return hearing


def by_what(lines: Iterable[Line]) -> dict[str, Line]:
    return {line.what: line for line in lines}


def test_a_long_text_is_put_together_from_its_parts() -> None:
    whole = "PreArm: AHRS: EK3 sources require VisualOdom and a good deal more than that"
    parts = [whole[:50], whole[50:]]
    hearing = heard(
        *(from_autopilot("STATUSTEXT", k, severity=2, text=part, id=7, chunk_seq=k) for k, part in enumerate(parts))
    )
    assert [text.text for text in hearing.texts] == [whole]


def test_only_the_peer_is_heard_and_other_autopilots_are_named() -> None:
    hearing = heard(
        beat(1),
        beat(2, system_id=9),
        replace(beat(3), system_id=255),
        beat(4, component_id=197, kind="INVALID"),
        from_autopilot("STATUSTEXT", 5, system_id=9, text="Arming motors"),
    )
    assert hearing.others == {9}
    assert not hearing.texts
    assert by_what(who_lines(hearing, HELI, None))["other autopilots"].mark is Mark.FAIL
    assert by_what(who_lines(hearing, HELI, 1))["other autopilots"].mark is Mark.WARN


def asked(requests: Requests, until_ns: int) -> list[Message]:
    times = range(0, until_ns, 20_000_000)
    return [message for now_ns in times if (message := requests.due(now_ns)) is not None]


def test_every_message_is_asked_for_again_until_it_comes() -> None:
    requests = Requests(HELI)
    requests.want(rates(Autopilot.ARDUPILOT, gyro=False))
    numbers = [message.fields["param1"] for message in asked(requests, 3 * SECOND_NS)]
    assert sorted(numbers) == sorted([148.0, 32.0, 30.0, 193.0] * 2)
    for name in ("AUTOPILOT_VERSION", POSITION, ATTITUDE, STATUS):
        requests.take(name)
    assert asked(requests, 10 * SECOND_NS) == []


def test_the_usual_rates_are_given_back() -> None:
    requests = Requests(HELI)
    requests.want(rates(Autopilot.PX4, gyro=True))
    assert {message.fields["param2"] for message in requests.farewell(0)} == {0.0}
    assert len(requests.farewell(0)) == 4


def poses(p_N: Array, v_N: Array) -> list[Pose]:
    """Return two seconds of poses in steady motion."""
    return [
        Pose(k * 50_000_000, p_N + v_N * k / 20.0, np.eye(3), np.array([0.0, 0.0, np.pi - 0.001])) for k in range(41)
    ]


@pytest.mark.parametrize(
    ("dp", "what", "mark"),
    [
        ([0.0, 0.0, 0.0], "its position", Mark.PASS),
        ([0.3, 0.0, 0.0], "its position", Mark.FAIL),
        ([0.0, 0.0, 0.3], "its position", Mark.FAIL),
    ],
)
def test_positions_are_compared_at_their_own_instant_in_motion_too(dp: list[float], what: str, mark: Mark) -> None:
    """At 2 m/s the words' 0.2 s on their way would be 0.4 m."""
    v_N = np.array([2.0, 0.0, 0.0])
    sync = SyncState(2 * SECOND_NS, 0.0, 4.0, 0.2, 600, 0, 0)
    shifted = [
        Pose(pose.t_ns + 4 * SECOND_NS, *(pose.p_N, pose.R_FtoN, pose.euler)) for pose in poses(np.zeros(3), v_N)
    ]
    hearing = Hearing((POSITION, ATTITUDE, STATUS))
    for k in range(2, 38):
        t_ns = k * 50_000_000 + 10_000_000
        x, y, z = (np.array(dp) + v_N * t_ns / 1e9).tolist()
        boot_ms = (t_ns + 2 * SECOND_NS) // 1_000_000
        arrived_ns = t_ns + 4_200_000_000
        hearing.take(from_autopilot(POSITION, arrived_ns, time_boot_ms=boot_ms, x=x, y=y, z=z), HELI)
        hearing.take(from_autopilot(ATTITUDE, arrived_ns, time_boot_ms=boot_ms, yaw=-np.pi + 0.01), HELI)
    lines = by_what(fusion_lines(hearing, shifted, sync, Autopilot.OTHER, 0))
    assert lines[what].mark is mark
    assert lines["its yaw"].mark is Mark.PASS  # across south, where the angle jumps


@pytest.mark.parametrize(
    ("flags", "variance", "filter_mark", "innovations_mark"),
    [
        (0x33F, 0.1, Mark.PASS, Mark.PASS),
        (0x33F, 0.6, Mark.PASS, Mark.WARN),
        (0x33F, 0.9, Mark.PASS, Mark.FAIL),
        (0x400, 0.0, Mark.FAIL, Mark.PASS),
        (0xA7, 0.0, Mark.FAIL, Mark.PASS),
    ],
)
def test_the_filters_own_word_is_judged(flags: int, variance: float, filter_mark: Mark, innovations_mark: Mark) -> None:
    hearing = heard(from_autopilot(STATUS, SECOND_NS, flags=flags, velocity_variance=variance))
    lines = by_what(fusion_lines(hearing, [], None, Autopilot.ARDUPILOT, 0))
    assert (lines["filter"].mark, lines["innovations"].mark) == (filter_mark, innovations_mark)


def test_without_timesync_the_message_that_travelled_least_sets_the_clock() -> None:
    messages = [
        from_autopilot(ATTITUDE, 10 * SECOND_NS + k * 20_000_000 + late_ns, time_boot_ms=20 * k)
        for k, late_ns in enumerate([30_000_000, 5_000_000, 80_000_000])
    ]
    assert our_times(messages, None) == [10 * SECOND_NS + 5_000_000 + k * 20_000_000 for k in range(3)]
    assert our_times(messages, SYNC) == [2 * SECOND_NS + k * 20_000_000 for k in range(3)]
