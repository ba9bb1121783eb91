"""What one autopilot has said: the newest message of each kind, its texts, and the worst its filter has shown."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass

from bridge.dialect import enum
from bridge.dialogue.peer import Peer
from bridge.pack import HEARTBEAT
from bridge.wire import Received

MAVLINK_1 = 0xFE
STATUSTEXT = "STATUSTEXT"
_KEPT = 4096
_KEPT_TEXTS = 64


@dataclass(frozen=True, slots=True)
class Text:
    """One STATUSTEXT. arrived_ns: of its last part [ns].  severity: MAV_SEVERITY."""

    arrived_ns: int
    severity: int
    text: str


class Hearing:
    """Listen to the peer alone.

    history: the newest messages of the names in `keep`, oldest first, in bounded memory.
    others: system ids of further autopilots on the link.  version_1: it speaks MAVLink 1.
    """

    def __init__(self, keep: tuple[str, ...]) -> None:
        self.last: dict[str, Received] = {}
        self.count: Counter[str] = Counter()
        self.history: Mapping[str, deque[Received]] = {name: deque(maxlen=_KEPT) for name in keep}
        self.texts: deque[Text] = deque(maxlen=_KEPT_TEXTS)
        self.others: set[int] = set()
        self.version_1 = False
        self._parts: dict[int, str] = {}

    def take(self, message: Received, peer: Peer) -> bool:
        """Take a message that came in on the link, and say whether it is the peer's."""
        if (message.system_id, message.component_id) != (peer.system_id, peer.component_id):
            self._meet(message, peer)
            return False
        self.version_1 = message.raw[0] == MAVLINK_1
        self.last[message.message] = message
        self.count[message.message] += 1
        if message.message in self.history:
            self.history[message.message].append(message)
        if message.message == STATUSTEXT:
            self._take_text(message)
        return True

    @property
    def armed(self) -> bool:
        """Whether its newest heartbeat says so."""
        beat = self.last.get(HEARTBEAT)
        return beat is not None and bool(beat.whole("base_mode") & enum("MAV_MODE_FLAG_SAFETY_ARMED"))

    def since(self, name: str, since_ns: int) -> list[Received]:
        """Return the kept messages of a name that arrived from an instant on [ns]."""
        return [message for message in self.history.get(name, ()) if message.arrived_ns >= since_ns]

    def _meet(self, message: Received, peer: Peer) -> None:
        invalid, station = enum("MAV_AUTOPILOT_INVALID"), 255
        if message.message == HEARTBEAT and message.whole("autopilot") != invalid and message.system_id != station:
            self.others |= {message.system_id} - {peer.system_id}

    def _take_text(self, message: Received) -> None:
        """Put the parts of a long text together: all but the last fill their 50 bytes."""
        number, part = message.whole("id"), str(message.fields["text"])
        whole = self._parts.pop(number, "") + part if number > 0 else part
        if number > 0 and len(part) == 50:
            self._parts[number] = whole
            return
        self.texts.append(Text(message.arrived_ns, message.whole("severity"), whole))
