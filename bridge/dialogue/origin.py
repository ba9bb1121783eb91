"""The global origin of an autopilot's local frame: told once, proved, never told again.

What ArduPilot's EKF3 does (found by flying its SITL): an origin that comes before "EKF3 active" is lost or, worse,
acknowledged and lost, after which every later one is refused until a reboot; 0, 0 is refused.

What PX4's EKF2 does from 1.16 on (read in its source; 1.17 development flown): when vision's height begins, it takes
the height above the room for one above the sea. So after a gap in the poses its local height jumps by the origin's
altitude, and it climbs as far. PX4 is told altitude 0 therefore, with which the two are the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from bridge.dialect import enum, make_message, message_id
from bridge.dialogue.peer import Autopilot, Peer
from bridge.wire import Message, Received

DO_SET_GLOBAL_ORIGIN = 611  # MAV_CMD of 2025, not yet in the dialect
EKF_UNINITIALISED = 0x400  # of EKF_STATUS_REPORT.flags, by ArduPilot
ASK_NS = 1_000_000_000
ANSWER_NS = 3_000_000_000  # within this an origin that was told must be there, or one that is there must be named
PROOF_NS = 15_000_000_000  # within this an autopilot with poses and an origin knows where on the globe it is
EARTH_M = 6_371_000.0
SAME_M = 1.0
TRIES = 3  # an origin told so often without an answer is a trouble to speak of


@dataclass(frozen=True, slots=True)
class Origin:
    """Where the room's origin lies on the globe. latitude_deg, longitude_deg: WGS 84.  altitude_m: above sea level."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float

    def distance_m(self, other: Origin) -> float:
        """Return how far another origin lies from this one [m]."""
        north = math.radians(other.latitude_deg - self.latitude_deg) * EARTH_M
        turn = (other.longitude_deg - self.longitude_deg + 180.0) % 360.0 - 180.0
        east = math.radians(turn) * EARTH_M * math.cos(math.radians(self.latitude_deg))
        return math.hypot(north, east, other.altitude_m - self.altitude_m)


class OriginState(StrEnum):
    """How far the matter of the origin has come."""

    ASKING = "asking the autopilot whether it has one"
    WAITING = "waiting for the autopilot's EKF"
    TOLD = "told, waiting for the autopilot to confirm"
    TOLD_BY_ANOTHER = "told over another link, waiting for the autopilot to confirm"
    SET = "set"
    MISSING = "the autopilot has none and the config names none; add [origin] to the config"
    REFUSED = "the autopilot refuses it"
    UNCONFIRMED = "told again and again, and the autopilot does not say that it has it; see whether the link loses much"
    LOST = "the autopilot acknowledged it and lost it; reboot the autopilot"


class Tellings:
    """Which system was told an origin, over whichever link: several may lead to one autopilot."""

    def __init__(self) -> None:
        self._last_ns: dict[int, int] = {}
        self._acknowledged: set[int] = set()

    def enter(self, system_id: int, now_ns: int) -> None:
        """Enter that a system is told now."""
        self._last_ns[system_id] = now_ns

    def acknowledge(self, system_id: int) -> None:
        """Enter that a system has taken what it was told."""
        self._acknowledged.add(system_id)

    def forget(self, system_id: int) -> None:
        """Enter that a system has started anew."""
        self._last_ns.pop(system_id, None)
        self._acknowledged.discard(system_id)

    def forbid(self, system_id: int, now_ns: int) -> bool:
        """Say whether a system is not to be told: it has taken one, or its answer to the last may still come."""
        last_ns = self._last_ns.get(system_id)
        return system_id in self._acknowledged or (last_ns is not None and now_ns - last_ns <= ANSWER_NS)


class OriginKeeper:
    """See that the autopilot has an origin.

    origin: to tell it, None for none.  tellings: shared by all links.  found: what the autopilot says it has.
    """

    def __init__(self, origin: Origin | None, tellings: Tellings) -> None:
        self._origin = origin
        self._tellings = tellings
        self._system_id: int | None = None
        self._plain = False  # by SET_GPS_GLOBAL_ORIGIN, since the command is not known there
        self.start_anew()

    def start_anew(self) -> None:
        """Forget what the autopilot said: it has only just started."""
        if self._system_id is not None:
            self._tellings.forget(self._system_id)
        self.found: Origin | None = None
        self.state = OriginState.ASKING
        self._ekf_ready = self._proved = False
        self._asked_ns: int | None = None
        self._since_ns: int | None = None  # the state's beginning
        self._told = self._acknowledged = False
        self._unconfirmed = 0  # tellings in a row of which nothing was heard

    @property
    def settled(self) -> bool:
        """Whether the autopilot says that it has an origin."""
        return self.found is not None

    def take(self, message: Received) -> None:
        """Take a message of the autopilot."""
        if message.message == "GPS_GLOBAL_ORIGIN":
            self._take_origin(message)
        elif message.message == "GLOBAL_POSITION_INT":
            self._proved = self._proved or (message.whole("lat") != 0 and message.whole("lon") != 0)
        elif message.message == "EKF_STATUS_REPORT":
            self._ekf_ready = not message.whole("flags") & EKF_UNINITIALISED
        elif message.message == "COMMAND_ACK" and message.whole("command") == DO_SET_GLOBAL_ORIGIN:
            self._take_acknowledgement(message)

    def due(self, peer: Peer, now_ns: int) -> list[Message]:
        """Return what is to be asked or told now."""
        if self._asked_ns is not None and now_ns - self._asked_ns < ASK_NS:
            return []
        self._asked_ns, self._system_id = now_ns, peer.system_id
        if self._since_ns is None:
            self._since_ns = now_ns
        if self.settled:
            return self._prove(peer, now_ns)
        messages = [_request(peer, "GPS_GLOBAL_ORIGIN", now_ns)]
        if peer.autopilot is Autopilot.ARDUPILOT and not self._ekf_ready:
            messages.append(_request(peer, "EKF_STATUS_REPORT", now_ns))
        return messages + self._tell_if_due(peer, now_ns, now_ns - self._since_ns)

    def _tell_if_due(self, peer: Peer, now_ns: int, waited_ns: int) -> list[Message]:
        """Tell the origin once it was asked for in vain; what hinders that becomes the state."""
        if self._told and (self._acknowledged or waited_ns <= ANSWER_NS):
            self.state = OriginState.LOST if waited_ns > ANSWER_NS else self.state
        elif self._origin is None:
            self.state = OriginState.MISSING if waited_ns >= ANSWER_NS else self.state
        elif peer.autopilot is Autopilot.ARDUPILOT and not self._ekf_ready:
            self.state = OriginState.WAITING
        elif waited_ns < (ANSWER_NS if self.state is OriginState.REFUSED else ASK_NS):
            return []
        elif self._tellings.forbid(peer.system_id, now_ns):
            self.state = OriginState.TOLD_BY_ANOTHER
        else:
            self._tellings.enter(peer.system_id, now_ns)
            self._told, self._since_ns = True, now_ns
            self._unconfirmed += 1
            self.state = OriginState.TOLD if self._unconfirmed <= TRIES else OriginState.UNCONFIRMED
            return [self._tell(peer, self._origin, now_ns)]
        return []

    def _prove(self, peer: Peer, now_ns: int) -> list[Message]:
        """Ask where an autopilot that has an origin says it is: nowhere means that the origin got lost in it."""
        if self._proved:
            self.state = OriginState.SET
            return []
        if peer.autopilot is not Autopilot.ARDUPILOT:
            return []
        if self._since_ns is not None and now_ns - self._since_ns > PROOF_NS:
            self.state = OriginState.LOST
        return [_request(peer, "GLOBAL_POSITION_INT", now_ns)]

    def _tell(self, peer: Peer, origin: Origin, now_ns: int) -> Message:
        altitude_m = 0.0 if peer.autopilot is Autopilot.PX4 else origin.altitude_m
        latitude, longitude = round(origin.latitude_deg * 1e7), round(origin.longitude_deg * 1e7)
        if self._plain or peer.autopilot is not Autopilot.ARDUPILOT:
            return make_message(
                "SET_GPS_GLOBAL_ORIGIN", now_ns, target_system=peer.system_id, latitude=latitude, longitude=longitude,
                altitude=round(altitude_m * 1000.0), time_usec=now_ns // 1000,
            )  # fmt: skip
        return make_message(
            "COMMAND_INT", now_ns, "origin", target_system=peer.system_id, target_component=peer.component_id,
            frame=enum("MAV_FRAME_GLOBAL"), command=DO_SET_GLOBAL_ORIGIN, x=latitude, y=longitude, z=altitude_m,
        )  # fmt: skip

    def _take_acknowledgement(self, ack: Received) -> None:
        """Take the answer to the command; one that is refused is told again later, by the message if need be."""
        result = ack.whole("result")
        if self.settled or not self._told:
            return
        self._unconfirmed = 0
        if result == enum("MAV_RESULT_ACCEPTED"):
            self._acknowledged = True
            if self._system_id is not None:
                self._tellings.acknowledge(self._system_id)
            return
        self._told, self._since_ns = False, ack.arrived_ns
        unknown = result == enum("MAV_RESULT_UNSUPPORTED")
        self._plain = self._plain or unknown
        self.state = OriginState.ASKING if unknown else OriginState.REFUSED

    def _take_origin(self, message: Received) -> None:
        """Take the autopilot's own word; zeros are none."""
        latitude, longitude = message.whole("latitude"), message.whole("longitude")
        if (latitude or longitude) and not self.settled:
            self.found = Origin(latitude / 1e7, longitude / 1e7, message.whole("altitude") / 1e3)
            self.state, self._since_ns = OriginState.SET, message.arrived_ns


def _request(peer: Peer, name: str, now_ns: int) -> Message:
    """Ask for one message now."""
    return make_message(
        "COMMAND_LONG", now_ns, name, target_system=peer.system_id, target_component=peer.component_id,
        command=enum("MAV_CMD_REQUEST_MESSAGE"), param1=float(message_id(name)),
    )  # fmt: skip
