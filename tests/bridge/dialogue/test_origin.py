"""The origin: told once the EKF stands, proved, and never a second time."""

from __future__ import annotations

import pytest

from bridge.dialect import enum
from bridge.dialogue.origin import DO_SET_GLOBAL_ORIGIN, Origin, OriginKeeper, OriginState, Tellings
from bridge.dialogue.peer import Autopilot, Peer
from bridge.wire import Message
from tests.bridge.dialogue.far_autopilot import BASE_NS, from_autopilot

PLACE = Origin(32.1, 34.8, 30.0)
HELI = Peer(1, 1, Autopilot.ARDUPILOT)
STEP_NS = 66_000_000
UNINITIALISED, READY = 0x400, 0xA7


class Autopilots:
    """An autopilot that answers, and what it was told. ekf_s: when its EKF stands [s]."""

    def __init__(self, keeper: OriginKeeper, *, ekf_s: float = 0.0, has: Origin | None = None) -> None:
        self.keeper = keeper
        self.ekf_s, self.has = ekf_s, has
        self.result = enum("MAV_RESULT_ACCEPTED")
        self.loses = self.deaf = False
        self.told: list[Message] = []
        self.now_ns = BASE_NS

    def state(self) -> OriginState:
        return self.keeper.state

    def settled(self) -> bool:
        return self.keeper.settled

    def fly(self, seconds: float, peer: Peer = HELI) -> None:
        """Let time pass."""
        end_ns = self.now_ns + round(seconds * 1e9)
        while self.now_ns < end_ns:
            for message in self.keeper.due(peer, self.now_ns):
                self._answer(message)
            self.now_ns += STEP_NS

    def _answer(self, message: Message) -> None:
        command, arrived_ns = message.fields.get("command"), self.now_ns + 1_000_000
        if message.name == "SET_GPS_GLOBAL_ORIGIN" or command == DO_SET_GLOBAL_ORIGIN:
            self.told.append(message)
            if self.deaf:
                return
            if command == DO_SET_GLOBAL_ORIGIN:
                self.keeper.take(
                    from_autopilot("COMMAND_ACK", arrived_ns, command=DO_SET_GLOBAL_ORIGIN, result=self.result)
                )
            if self.result == enum("MAV_RESULT_ACCEPTED") or message.name == "SET_GPS_GLOBAL_ORIGIN":
                self.has = PLACE
        elif message.fields["param1"] == 49.0 and self.has is not None:
            self.keeper.take(
                from_autopilot(
                    "GPS_GLOBAL_ORIGIN", arrived_ns, latitude=round(self.has.latitude_deg * 1e7),
                    longitude=round(self.has.longitude_deg * 1e7), altitude=round(self.has.altitude_m * 1e3),
                )
            )  # fmt: skip
        elif message.fields["param1"] == 193.0:
            stands = self.now_ns >= BASE_NS + self.ekf_s * 1e9
            flags = READY if stands else UNINITIALISED
            self.keeper.take(from_autopilot("EKF_STATUS_REPORT", arrived_ns, flags=flags))
        elif message.fields["param1"] == 33.0 and self.has is not None:
            lat = 0 if self.loses else round(self.has.latitude_deg * 1e7)
            self.keeper.take(from_autopilot("GLOBAL_POSITION_INT", arrived_ns, lat=lat, lon=348_000_000))


def test_it_is_told_once_and_only_after_the_ekf_stands() -> None:
    pilot = Autopilots(OriginKeeper(PLACE, Tellings()), ekf_s=4.2)
    pilot.fly(4.0)
    assert not pilot.told
    assert pilot.state() is OriginState.WAITING
    assert not pilot.settled()
    pilot.fly(60.0)
    (told,) = pilot.told
    assert told.name == "COMMAND_INT"
    assert (told.fields["x"], told.fields["y"], told.fields["z"]) == (321_000_000, 348_000_000, 30.0)
    assert pilot.settled()
    assert pilot.state() is OriginState.SET


def test_an_autopilot_that_has_one_is_told_none() -> None:
    pilot = Autopilots(OriginKeeper(PLACE, Tellings()), has=Origin(10.0, 20.0, 5.0))
    pilot.fly(10.0)
    assert not pilot.told
    assert pilot.keeper.found == Origin(10.0, 20.0, 5.0)
    assert PLACE.distance_m(Origin(32.1, 34.8 + 1e-5, 30.0)) == pytest.approx(0.94, abs=0.01)


def test_where_the_command_is_not_known_the_message_does_it() -> None:
    pilot = Autopilots(OriginKeeper(PLACE, Tellings()))
    pilot.result = enum("MAV_RESULT_UNSUPPORTED")
    pilot.fly(8.0)
    assert [message.name for message in pilot.told] == ["COMMAND_INT", "SET_GPS_GLOBAL_ORIGIN"]
    assert pilot.settled()


def test_a_refused_one_is_told_again_later() -> None:
    pilot = Autopilots(OriginKeeper(PLACE, Tellings()))
    pilot.result = enum("MAV_RESULT_FAILED")
    pilot.fly(3.5)
    assert pilot.state() is OriginState.REFUSED
    assert len(pilot.told) == 1
    pilot.result = enum("MAV_RESULT_ACCEPTED")
    pilot.fly(5.0)
    assert len(pilot.told) == 2
    assert pilot.state() is OriginState.SET


def test_one_that_got_lost_on_its_way_is_told_again_and_in_the_end_spoken_of() -> None:
    pilot = Autopilots(OriginKeeper(PLACE, Tellings()))
    pilot.deaf = True
    pilot.fly(6.0)
    assert pilot.state() is OriginState.TOLD
    assert len(pilot.told) == 2
    pilot.fly(14.0)
    assert pilot.state() is OriginState.UNCONFIRMED
    pilot.deaf = False
    pilot.fly(6.0)
    assert pilot.state() is OriginState.SET


def test_one_autopilot_at_the_end_of_two_links_is_told_over_one_of_them() -> None:
    tellings = Tellings()
    first, second = (Autopilots(OriginKeeper(PLACE, tellings)) for _ in range(2))
    for _ in range(80):  # the second never sees the first's origin
        first.fly(0.1)
        second.fly(0.1)
    assert (len(first.told), len(second.told)) == (1, 0)
    assert second.state() is OriginState.TOLD_BY_ANOTHER
    second.has = first.has
    second.fly(2.0)
    assert second.state() is OriginState.SET


def test_two_autopilots_at_the_ends_of_two_links_are_both_told() -> None:
    tellings = Tellings()
    first, second = (Autopilots(OriginKeeper(PLACE, tellings)) for _ in range(2))
    first.fly(5.0)
    second.fly(5.0, Peer(2, 1, Autopilot.ARDUPILOT))
    assert first.settled()
    assert second.settled()


def test_one_that_was_acknowledged_and_lost_is_found_out() -> None:
    pilot = Autopilots(OriginKeeper(PLACE, Tellings()))
    pilot.loses = True
    pilot.fly(10.0)
    assert pilot.state() is OriginState.SET
    pilot.fly(12.0)
    assert pilot.state() is OriginState.LOST
    assert len(pilot.told) == 1  # a second one would be refused


def test_without_one_in_the_config_nothing_is_told_and_it_says_so() -> None:
    pilot = Autopilots(OriginKeeper(None, Tellings()))
    pilot.fly(5.0)
    assert not pilot.told
    assert pilot.state() is OriginState.MISSING


def test_after_a_reboot_it_is_told_again() -> None:
    pilot = Autopilots(OriginKeeper(PLACE, Tellings()))
    pilot.fly(5.0)
    pilot.has = None
    pilot.keeper.start_anew()
    assert not pilot.settled()
    pilot.fly(5.0)
    assert len(pilot.told) == 2
    assert pilot.settled()


def test_a_px4_is_told_altitude_0_since_its_height_would_jump_by_any_other() -> None:
    far = Autopilots(OriginKeeper(PLACE, Tellings()))
    far.fly(3.0, Peer(1, 1, Autopilot.PX4))
    (told,) = far.told
    assert told.name == "SET_GPS_GLOBAL_ORIGIN"
    assert (told.fields["latitude"], told.fields["altitude"]) == (321_000_000, 0)
