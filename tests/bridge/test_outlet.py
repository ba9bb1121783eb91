"""The outlet as an autopilot sees it: who speaks, what, how often, and never twice."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import pytest

from bridge.dialect import Encoder, Identity, Reader, make_message
from bridge.dialogue import Terms
from bridge.links import MemoryLink, open_link
from bridge.outlet import Outlet, Spout
from bridge.pack import Packer
from tests.bridge.estimates import estimate, step
from tests.bridge.mavlink_by_hand import ByHand, parse
from tests.bridge.outlets import MOCAP, NOTHING, ODOMETRY, PERIOD_NS, SPEED, VISION, flight, outlet_to, terms
from tracker.errors import OperatorError


def memory_outlet(*messages: tuple[str, ...]) -> tuple[Outlet, list[MemoryLink]]:
    """Return an outlet with a memory link for each selection of messages, and the links."""
    links = [open_link(f"memory:{k}", Encoder(Identity(7)), itertools.count().__next__) for k in range(len(messages))]
    memories = [link for link in links if isinstance(link, MemoryLink)]
    return Outlet(
        [Spout(link, terms(names)) for link, names in zip(memories, messages, strict=True)], Packer(0.0)
    ), memories


def frames(link: MemoryLink) -> list[ByHand]:
    return parse(b"".join(link.frames))


def test_each_link_gets_its_own_messages_one_of_each_an_estimate() -> None:
    outlet, (both, speed, silent) = memory_outlet((VISION, MOCAP), (SPEED,), ())
    outlet.send(step(estimate(t_ns=2000), estimate(t_ns=3000)), 3000)
    assert [frame.name for frame in frames(both)] == ["HEARTBEAT", VISION, MOCAP, VISION, MOCAP]
    assert [frame.fields["usec"] for frame in frames(both) if frame.name == VISION] == [2, 3]
    assert [frame.name for frame in frames(speed)] == ["HEARTBEAT", SPEED, SPEED]
    assert [frame.name for frame in frames(silent)] == ["HEARTBEAT"]


def test_an_estimate_is_never_sent_again() -> None:
    outlet, (link,) = memory_outlet((VISION,))
    outlet.send(step(estimate()), 0)
    for k in range(1, 25):
        assert outlet.send(NOTHING, k * PERIOD_NS) == ()
    assert [frame.name for frame in frames(link)] == ["HEARTBEAT", VISION]


def test_every_frame_bears_the_identity_and_the_links_own_sequence() -> None:
    outlet, links = memory_outlet((VISION, MOCAP), (SPEED,))
    for now, now_ns in flight(200):
        outlet.send(now, now_ns)
    for link, count in zip(links, (407, 207), strict=True):
        assert [frame.sequence for frame in frames(link)] == [k % 256 for k in range(count)]
        assert {(frame.system_id, frame.component_id) for frame in frames(link)} == {(7, 197)}


def beat_times(times_ns: Sequence[int]) -> list[int]:
    """Return the stream times of the heartbeats sent when the loop turns at these times."""
    outlet, _ = memory_outlet(())
    return [record.t_ns for time_ns in times_ns for record in outlet.send(NOTHING, time_ns)]


def test_heartbeats_leave_once_a_second_of_stream_time_and_at_once() -> None:
    start_ns = 5_123_456_789
    times = beat_times([start_ns + k * 50_000_000 for k in range(101)])
    assert times == [start_ns + k * 1_000_000_000 for k in range(6)]


def test_heartbeats_keep_their_mean_rate_when_frames_do_not_fall_on_the_second() -> None:
    assert len(beat_times([k * 70_000_000 for k in range(1000)])) == 70


def test_heartbeats_do_not_come_in_a_burst_after_a_gap() -> None:
    assert beat_times([0, 7_500_000_000, 7_600_000_000, 8_500_000_000]) == [0, 7_500_000_000, 8_500_000_000]


def test_the_same_input_gives_the_same_bytes() -> None:
    def sent_bytes() -> list[bytes]:
        outlet, links = memory_outlet((VISION, MOCAP), (SPEED,))
        for now, now_ns in flight(100):
            outlet.send(now, now_ns)
        return [b"".join(link.frames) for link in links]

    assert sent_bytes() == sent_bytes()


def test_records_tell_what_left_when_and_of_which_frame() -> None:
    outlet = outlet_to([("memory:", (MOCAP,))], itertools.count(1000, 10).__next__)
    heartbeat, pose = outlet.send(step(estimate(t_ns=123_456, available_ns=77)), 200_000)
    assert (heartbeat.message, heartbeat.t_ns, heartbeat.available_ns) == ("HEARTBEAT", 200_000, 0)
    assert (pose.message, pose.t_ns, pose.available_ns) == (MOCAP, 123_456, 77)
    assert (heartbeat.sent_ns, pose.sent_ns) == (1000, 1010)
    assert heartbeat.link == pose.link == "memory:"
    (frame,) = parse(pose.raw)
    assert dict(pose.fields) == frame.fields
    assert outlet.close() == ()


@pytest.mark.parametrize(
    ("links", "words"),
    [
        ([("memory:", ("ODOMETER",))], "message ODOMETER is not known; known are VISION_POSITION_ESTIMATE, ATT_POS_"),
        ([("memory:", ()), ("memory:", ())], "given 2 times"),
        ([("memory:", (VISION, VISION))], "must differ"),
    ],
)
def test_a_selection_that_makes_no_sense_is_refused(links: list[tuple[str, tuple[str, ...]]], words: str) -> None:
    with pytest.raises(OperatorError, match=words):
        outlet_to(links)


def test_the_bridge_speaks_for_the_vehicle_it_hears() -> None:
    link = open_link("memory:", encoder := Encoder(Identity(1)), itertools.count().__next__)
    assert isinstance(link, MemoryLink)
    outlet = Outlet([Spout(link, Terms(), encoder)], Packer(0.0))
    outlet.listen(itertools.count(1).__next__)
    outlet.send(NOTHING, 0)
    autopilot = make_message("HEARTBEAT", 0, type=4, autopilot=12)
    link.deliver(Encoder(Identity(42, 1))(autopilot, 0))
    outlet.send(NOTHING, 10)
    outlet.send(step(estimate(t_ns=20)), 20)
    spoken = Reader().feed(b"".join(link.frames))
    assert (spoken[0].system_id, spoken[0].component_id) == (1, 197)
    assert spoken[-1].message == ODOMETRY  # a PX4, by its heartbeat
    assert (spoken[-1].system_id, spoken[-1].component_id) == (42, 197)
