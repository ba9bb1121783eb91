"""The outlet and what is at the other end of its links: there, gone, back, and talking."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from time import perf_counter_ns
from typing import cast

import pytest

from bridge.dialect import Encoder, Identity, make_message
from bridge.links import open_link
from bridge.outlet import Outlet, Spout
from bridge.pack import Packer
from bridge.wire import Received, Sent
from tests.bridge.estimates import beat, estimate, step
from tests.bridge.mavlink_by_hand import ByHand
from tests.bridge.outlets import MOCAP, NOTHING, VISION, flight, outlet_to, terms
from tests.contracts.far_ends import FarEnd, SerialFar, SlowSerialFar, TcpFar, UdpCaller, UdpFar, eventually
from tracker.errors import OperatorError


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
