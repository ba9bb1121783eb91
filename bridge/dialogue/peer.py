"""Which autopilot a link leads to, by its heartbeat. Whoever else talks there is not listened to."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from bridge.dialect import enum
from bridge.pack import HEARTBEAT
from bridge.wire import Received

_OURS = 197  # our own component, as forwarded back by an autopilot


class Autopilot(StrEnum):
    """The kinds of autopilot that differ in what they want."""

    ARDUPILOT = "ArduPilot"
    PX4 = "PX4"
    OTHER = "other autopilot"


@dataclass(frozen=True, slots=True)
class Peer:
    """One autopilot."""

    system_id: int
    component_id: int
    autopilot: Autopilot


class PeerWatch:
    """Find the autopilot on a link and stay with it.

    system_id: the vehicle's, None to take the first one heard.
    strangers: messages of systems that are not the peer; other_autopilot: id of a second autopilot, None for none.
    """

    def __init__(self, system_id: int | None) -> None:
        self._wanted = system_id
        self.peer: Peer | None = None
        self.strangers = 0
        self.other_autopilot: int | None = None
        self.armed = False

    def takes(self, message: Received) -> bool:
        """Say whether a message is the autopilot's own, learning from heartbeats which one that is."""
        if message.message == HEARTBEAT and self._is_autopilot(message):
            self._meet(message)
        ours = self.peer is not None and (message.system_id, message.component_id) == (
            self.peer.system_id,
            self.peer.component_id,
        )
        self.strangers += not ours
        return ours

    def _meet(self, heartbeat: Received) -> None:
        """Take a heartbeat of an autopilot: the first one of the vehicle stays the peer for good."""
        wanted = self._wanted if self.peer is None else self.peer.system_id
        if wanted is not None and heartbeat.system_id != wanted:
            self.other_autopilot = heartbeat.system_id
            return
        kinds = {enum("MAV_AUTOPILOT_ARDUPILOTMEGA"): Autopilot.ARDUPILOT, enum("MAV_AUTOPILOT_PX4"): Autopilot.PX4}
        kind = kinds.get(heartbeat.whole("autopilot"), Autopilot.OTHER)
        if self.peer is None:
            self.peer = Peer(heartbeat.system_id, heartbeat.component_id, kind)
        self.armed = bool(heartbeat.whole("base_mode") & enum("MAV_MODE_FLAG_SAFETY_ARMED"))

    @staticmethod
    def _is_autopilot(heartbeat: Received) -> bool:
        """Say whether an autopilot beats there: not a ground station, a companion, or our own beat sent back."""
        return (
            heartbeat.fields["autopilot"] != enum("MAV_AUTOPILOT_INVALID")
            and heartbeat.component_id != _OURS
            and heartbeat.system_id != 255
        )
