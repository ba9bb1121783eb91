"""A bridge goes on whatever its links and far ends do: the real loop, real ports, an autopilot that talks back."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import monotonic_ns

import pytest

from bridge.dialect import Reader
from bridge.dialogue import Origin, Terms
from bridge.dialogue.origin import OriginState
from tests.contracts.far_ends import FarEnd, PacedSerialFar, SerialFar, TcpFar, UdpCaller, UdpFar
from tests.system.staying_up.autopilot import StandIn
from tests.system.staying_up.flight import Flight, Plan, until

TALK = Terms(origin=Origin(32.1, 34.8, 30.0), max_age_ns=10**10)
ON_ITS_WAY = 20  # frames: a message waits for the wire one, two or three, never a second
SILENT = "connection refused: nobody listens there"


def settled(flight: Flight) -> bool:
    """Say whether poses flow to an autopilot that has its origin and whose clock is known."""
    far = flight.far()
    return far.origin == str(OriginState.SET) and far.sync is not None and far.sync.samples >= 5


def restarts(flight: Flight) -> int:
    """Return how often the autopilot's clock has been learned anew."""
    sync = flight.far().sync
    return 0 if sync is None else sync.restarts


@pytest.mark.parametrize("kind", [UdpFar, SerialFar, TcpFar])
def test_an_autopilot_that_reboots_is_told_its_origin_again_and_keeps_its_profile(
    kind: Callable[[Path], FarEnd], tmp_path: Path
) -> None:
    end = kind(tmp_path)
    autopilot = StandIn(end)

    def plan(flight: Flight) -> Plan:
        if isinstance(end, TcpFar):
            end.accept()
        yield from until(lambda: settled(flight) and bool(autopilot.poses()), autopilot.turn)
        assert (flight.far().profile, autopilot.told_origins()) == ("ardupilot", 1)
        autopilot.boot()
        yield from until(lambda: flight.far().origin != str(OriginState.SET), autopilot.turn)
        assert flight.far().profile == "ardupilot"
        yield from until(lambda: settled(flight) and restarts(flight) == 1, autopilot.turn)
        before = len(autopilot.poses())
        yield from until(lambda: len(autopilot.poses()) > before, autopilot.turn)
        assert autopilot.told_origins() == 1
        assert "posebridge: autopilot clock stepped (1)" in autopilot.texts()
        sync = flight.far().sync
        assert sync is not None
        assert sync.offset_ns == pytest.approx(monotonic_ns() - autopilot.now_ns(), abs=10_000_000)

    Flight([(end.uri, TALK)]).fly(plan)
    end.vanish()


def test_a_udp_peer_that_closes_its_port_and_opens_it_again_gets_the_new_poses_and_none_of_the_old(
    tmp_path: Path,
) -> None:
    end = UdpFar(tmp_path)
    autopilot = StandIn(end)

    def plan(flight: Flight) -> Plan:
        yield from until(lambda: settled(flight) and bool(autopilot.poses()), autopilot.turn)
        end.vanish()
        yield from until(lambda: "link_down" in flight.alarms)
        assert (flight.link().up, flight.link().reason) == (False, SILENT)
        assert SILENT in flight.status_line()
        autopilot.heard.clear()
        back_us = monotonic_ns() // 1000
        end.come_back()
        yield from until(lambda: bool(autopilot.poses()) and flight.link().up, autopilot.turn)
        assert min(autopilot.poses()) >= back_us
        yield from until(lambda: not flight.stands("link_down"), autopilot.turn)
        assert autopilot.told_origins() == 0

    Flight([(end.uri, TALK)]).fly(plan)
    end.vanish()


def test_an_autopilot_that_calls_from_another_port_after_its_restart_is_answered_there(tmp_path: Path) -> None:
    end = UdpCaller(tmp_path)
    autopilot = StandIn(end, calls=True)

    def plan(flight: Flight) -> Plan:
        yield from until(lambda: settled(flight) and bool(autopilot.poses()), autopilot.turn)
        end.vanish()
        yield from until(lambda: "autopilot_silent" in flight.alarms)
        assert "ArduPilot SILENT" in flight.status_line()
        end.come_back()
        autopilot.boot()
        back_us = monotonic_ns() // 1000
        yield from until(lambda: settled(flight) and restarts(flight) == 1 and bool(autopilot.poses()), autopilot.turn)
        assert min(autopilot.poses()) >= back_us
        assert not flight.stands("autopilot_silent")
        assert "posebridge: autopilot heard again" in autopilot.texts()
        assert autopilot.told_origins() == 1

    Flight([(end.uri, TALK)]).fly(plan)
    end.vanish()


def test_a_serial_port_unplugged_and_plugged_in_again_goes_on_with_the_newest(tmp_path: Path) -> None:
    end = SerialFar(tmp_path)
    autopilot = StandIn(end)

    def plan(flight: Flight) -> Plan:
        yield from until(lambda: settled(flight) and bool(autopilot.poses()), autopilot.turn)
        end.vanish()
        yield from until(lambda: "link_down" in flight.alarms)
        assert not flight.link().up
        before = flight.link().dropped
        yield from until(lambda: flight.link().dropped > before)
        autopilot.heard.clear()
        back_us = monotonic_ns() // 1000
        end.come_back()
        yield from until(lambda: bool(autopilot.poses()) and flight.link().up, autopilot.turn)
        assert min(autopilot.poses()) >= back_us - 100_000  # one frame and a message may be under way
        assert autopilot.told_origins() == 0

    Flight([(end.uri, TALK), ("memory:other", Terms(messages=("ATT_POS_MOCAP",), max_age_ns=10**10))]).fly(plan)
    end.vanish()


def test_a_second_autopilot_on_the_same_port_is_not_listened_to_and_that_is_told(tmp_path: Path) -> None:
    end = UdpFar(tmp_path)
    first, second = StandIn(end, system_id=3), StandIn(end, system_id=4)

    def both() -> None:
        first.turn()
        second.heard = first.heard  # it has heard of us by the same port, and would answer as loudly
        second.turn()

    def plan(flight: Flight) -> Plan:
        yield from until(lambda: settled(flight), first.turn)
        second.tell_lies()
        yield from until(lambda: "posebridge: autopilot 4 ignored" in first.texts(), both)
        before = flight.far().strangers
        yield from until(lambda: flight.far().strangers >= before + 5, both)
        far = flight.far()
        assert far.peer is not None
        assert (far.peer.system_id, far.origin) == (3, str(OriginState.SET))
        assert far.sync is not None
        assert far.sync.restarts == 0
        assert far.sync.offset_ns == pytest.approx(monotonic_ns() - first.now_ns(), abs=10_000_000)
        assert {message.system_id for message in first.heard[-20:]} == {3}

    Flight([(end.uri, TALK)]).fly(plan)
    end.vanish()


def test_a_full_line_carries_whole_messages_the_newest_first_at_the_rate_that_fits_and_it_is_said(
    tmp_path: Path,
) -> None:
    """Three messages a pose, 443 bytes, 50 poses a second: 22 kB/s for a line of 5.76 kB/s."""
    end = PacedSerialFar(tmp_path)
    autopilot = StandIn(end)
    lags: list[int] = []

    def turn(flight: Flight) -> None:
        known = len(autopilot.poses())
        autopilot.turn()
        lags.extend(sum(t_us > stamp for t_us in flight.frames_us) for stamp in autopilot.poses()[known:])

    def plan(flight: Flight) -> Plan:
        yield from until(lambda: flight.far().full and len(autopilot.poses()) >= 40, lambda: turn(flight))
        yield from until(lambda: "link_full" in flight.alarms, lambda: turn(flight))
        yield from until(lambda: "posebridge: link full, rate reduced" in autopilot.texts(), lambda: turn(flight))
        assert "LINK FULL" in flight.status_line()
        assert (flight.link().up, flight.link().dropped) == (True, 0)
        assert flight.link().superseded > 0
        flight.rate_hz = 5.0
        yield from until(lambda: "posebridge: link free again" in autopilot.texts(), lambda: turn(flight))
        assert not flight.far().full

    many = ("VISION_POSITION_ESTIMATE", "VISION_SPEED_ESTIMATE", "ODOMETRY")
    Flight([(end.uri, replace(TALK, messages=many))]).fly(plan)
    stamps = autopilot.poses()
    assert stamps == sorted(set(stamps))
    assert statistics.quantiles(lags, n=10)[-1] <= ON_ITS_WAY
    raw = b"".join(message.raw for message in Reader().feed(bytes(autopilot.bytes_came)))
    assert bytes(autopilot.bytes_came).startswith(raw)
    assert len(autopilot.bytes_came) - len(raw) < 300  # one message may be under way
    end.vanish()
