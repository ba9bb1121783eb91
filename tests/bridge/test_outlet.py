"""The outlet as an autopilot sees it: who speaks, what, how often, and never twice."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from time import perf_counter_ns
from typing import cast

import numpy as np
import pytest

from bridge.clock import Nanoseconds
from bridge.dialect import Encoder, Identity, Reader, make_message
from bridge.dialogue import Terms
from bridge.links import MemoryLink, open_link
from bridge.outlet import Outlet, Spout, open_outlet
from bridge.pack import MESSAGES, Packer
from bridge.wire import Received, Sent
from tests.bridge.estimates import beat, estimate, random_covariance, step
from tests.bridge.mavlink_by_hand import ByHand, parse
from tests.contracts.far_ends import FarEnd, SerialFar, SlowSerialFar, TcpFar, UdpCaller, UdpFar, eventually
from tracker.errors import OperatorError
from tracker.maths import so3
from tracker.types import Step

VISION, MOCAP, SPEED, ODOMETRY = MESSAGES
NO_LIMIT_NS = 10**18
PERIOD_NS = 33_333_333
NOTHING = step()


def terms(messages: tuple[str, ...]) -> Terms:
    return Terms(messages=messages, vehicle_id=7, max_age_ns=NO_LIMIT_NS)


def outlet_to(links: Sequence[tuple[str, tuple[str, ...]]], stopwatch: Nanoseconds = perf_counter_ns) -> Outlet:
    return open_outlet(
        [(uri, terms(messages)) for uri, messages in links],
        component_id=197,
        room_yaw_deg=0.0,
        stopwatch=stopwatch,
    )


def memory_outlet(*messages: tuple[str, ...]) -> tuple[Outlet, list[MemoryLink]]:
    """Return an outlet with a memory link for each selection of messages, and the links."""
    links = [open_link(f"memory:{k}", Encoder(Identity(7)), itertools.count().__next__) for k in range(len(messages))]
    memories = [link for link in links if isinstance(link, MemoryLink)]
    return Outlet(
        [Spout(link, terms(names)) for link, names in zip(memories, messages, strict=True)], Packer(0.0)
    ), memories


def frames(link: MemoryLink) -> list[ByHand]:
    return parse(b"".join(link.frames))


def flight(count: int) -> Iterator[tuple[Step, int]]:
    """Give steps 30 times a second, each with one estimate, and stream times."""
    generator = np.random.default_rng(5)
    for k in range(count):
        pose = estimate(
            t_ns=k * PERIOD_NS,
            p_BinW=generator.normal(size=3),
            R_BtoW=so3.exp(generator.normal(size=3)),
            v_BinW=generator.normal(size=3),
            covariance=random_covariance(generator, 12),
            available_ns=k + 1,
        )
        yield step(pose), pose.t_ns


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


@pytest.mark.parametrize("kind", [UdpFar, UdpCaller, SerialFar, SlowSerialFar, TcpFar])
def test_a_flight_arrives_whole_at_a_real_far_end(kind: Callable[[Path], FarEnd], tmp_path: Path) -> None:
    far = kind(tmp_path)
    link = open_link(far.uri, Encoder(Identity(7)), perf_counter_ns)
    outlet = Outlet([Spout(link, terms((VISION, MOCAP)))], Packer(0.0))
    far.meet(link)
    arrived: list[ByHand] = []
    records: list[Sent] = []
    for now, now_ns in flight(100):
        records += outlet.send(now, now_ns)
        while not arrived or arrived[-1].fields.get("time_usec") != now_ns // 1000:
            arrived += far.frames(1)
    records += outlet.close()
    assert [frame.sequence for frame in arrived] == [k % 256 for k in range(204)]
    assert [frame.raw for frame in arrived] == [record.raw for record in records]
    assert [frame.fields["usec"] for frame in arrived if frame.name == VISION] == [
        now_ns // 1000 for _, now_ns in flight(100)
    ]
    far.vanish()


def test_a_udp_datagram_is_there_when_send_returns(tmp_path: Path) -> None:
    far = UdpFar(tmp_path)
    outlet = outlet_to([(far.uri, (VISION,))])
    far.socket.setblocking(False)
    for now, now_ns in flight(5):
        raw = [record.raw for record in outlet.send(now, now_ns)]
        assert [far.socket.recv(300) for _ in raw] == raw
    outlet.close()
    far.vanish()


def test_a_lost_serial_port_costs_the_other_link_nothing_and_gets_no_old_pose_when_it_is_back(tmp_path: Path) -> None:
    far = SerialFar(tmp_path)
    outlet = outlet_to([(far.uri, (VISION,)), ("memory:", (VISION,))])
    far.vanish()
    clock = itertools.count(1)
    sent: list[int] = []

    def send_one() -> None:
        sent.append(next(clock))
        outlet.send(step(estimate(t_ns=sent[-1] * 1000)), sent[-1] * 1000)

    def send_until(serial_up: bool) -> None:
        def looked() -> bool:
            send_one()
            return outlet.link_states()[0].up is serial_up

        eventually(looked)

    send_until(serial_up=False)
    lost_before = len(sent)
    far.come_back()
    send_until(serial_up=True)
    poses: list[int] = []

    def pose_arrived() -> bool:
        send_one()
        poses.extend(cast(int, frame.fields["usec"]) for frame in far.frames(1) if frame.name == VISION)
        return bool(poses)

    eventually(pose_arrived)
    assert poses[0] > lost_before
    assert outlet.link_states()[1].sent == len(sent) + 1  # the one heartbeat
    outlet.close()
    far.vanish()


def test_link_states_tell_of_a_peer_that_is_not_there(tmp_path: Path) -> None:
    far = UdpFar(tmp_path)
    far.vanish()
    outlet = outlet_to([(far.uri, (VISION, MOCAP)), ("memory:", (VISION,))])
    for now, now_ns in flight(3):
        outlet.send(now, now_ns)
    gone, memory = outlet.link_states()
    assert (gone.name, gone.up, gone.reason) == (far.uri, False, "connection refused: nobody listens there")
    assert gone.dropped == gone.sent - 1  # the kernel took them all; each but the last has come back refused
    assert (memory.up, memory.reason, memory.sent, memory.dropped) == (True, "", 4, 0)
    outlet.close()


def test_messages_that_come_in_are_decoded_and_named_by_link(tmp_path: Path) -> None:
    far = UdpCaller(tmp_path)
    outlet = outlet_to([("memory:", ()), (far.uri, ())])
    outlet.listen(itertools.count(5).__next__)
    raw = Encoder(Identity(1, 1))(beat(42), 9)
    far.write(raw[:5])
    far.write(b"")
    far.write(raw[5:] + b"\xfd garbage")
    received: list[tuple[str, Received]] = []

    def arrived() -> bool:
        outlet.send(NOTHING, 0)
        received.extend(outlet.received())
        return bool(received)

    eventually(arrived)
    ((name, message),) = received
    assert message.arrived_ns >= 5
    assert (name, message.message, message.system_id, message.component_id) == (far.uri, "HEARTBEAT", 1, 1)
    assert message.fields["custom_mode"] == 42
    outlet.close()
    far.vanish()


def test_what_a_serial_link_still_holds_is_reported_by_close(tmp_path: Path) -> None:
    far = SerialFar(tmp_path)
    outlet = outlet_to([(far.uri, (VISION,))])
    records = outlet.send(step(estimate()), 0) + outlet.close()
    assert [record.message for record in records] == ["HEARTBEAT", VISION]
    assert [frame.name for frame in far.frames(2)] == ["HEARTBEAT", VISION]
    far.vanish()


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


def test_a_link_that_does_not_open_lets_go_of_those_that_did(tmp_path: Path) -> None:
    far = UdpCaller(tmp_path)
    with pytest.raises(OperatorError, match="no device"):
        outlet_to([(far.uri, ()), ("serial:/dev/ttyNone:57600", ())])
    outlet_to([(far.uri, ())]).close()
    far.vanish()


@pytest.mark.parametrize("kind", [UdpFar, UdpCaller, SerialFar, TcpFar])
def test_a_time_request_is_answered_at_once_though_the_loop_stands_still(
    kind: Callable[[Path], FarEnd], tmp_path: Path
) -> None:
    """PX4 believes stamps only after its requests were answered within 10 ms; the loop comes by once a frame."""
    far = kind(tmp_path)
    link = open_link(far.uri, Encoder(Identity(7)), perf_counter_ns)
    outlet = Outlet([Spout(link, terms((VISION,)))], Packer(0.0))
    far.meet(link)
    outlet.send(NOTHING, 0)
    assert [frame.name for frame in far.frames(1)] == ["HEARTBEAT"]
    outlet.listen(lambda: 123_456_789)
    far.write(Encoder(Identity(7, 1))(make_message("TIMESYNC", 0, tc1=0, ts1=42), 0))
    (answer,) = far.frames(1)
    assert (answer.name, answer.fields) == ("TIMESYNC", {"tc1": 123_456_789, "ts1": 42})
    outlet.close()
    far.vanish()


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
