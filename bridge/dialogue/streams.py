"""What the autopilot is asked to tell of itself, so that a log is enough for system identification."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from bridge.dialect import enum, frame_bytes, make_message, message_id
from bridge.dialogue.peer import Autopilot, Peer
from bridge.wire import Message, Received

ANSWER_NS = 1_000_000_000
TRIES = 3
SILENT_NS = 3_000_000_000  # a stream that was granted and has stopped for so long is asked for again
REST_NS = 10_000_000_000  # but not before so long after the last asking
SHARE = (
    0.5  # of what a serial line carries; the rest is for time sync, parameters and what the ground station asked for
)
REFUSED, UNANSWERED = "refused", "not answered"
SLOW_HZ = 2.0  # what changes slowly, where the line is narrow
SLOW = ("BATTERY_STATUS",)
SHARED = ("SERVO_OUTPUT_RAW", "RC_CHANNELS", "ATTITUDE", "LOCAL_POSITION_NED", "BATTERY_STATUS")
IMU: Mapping[Autopilot, str] = MappingProxyType(
    {Autopilot.ARDUPILOT: "RAW_IMU", Autopilot.PX4: "HIGHRES_IMU", Autopilot.OTHER: "SCALED_IMU"}
)


@dataclass(frozen=True, slots=True)
class Wanted:
    """How much is wanted.

    rate_hz: of each message, 0 to ask for nothing [Hz].
    line_bytes_s: what the line carries from the autopilot to us, None where that is no limit [B/s].
    """

    rate_hz: float = 0.0
    line_bytes_s: float | None = None

    def rates_hz(self, kind: Autopilot) -> dict[str, float]:
        """Return the messages to ask an autopilot for, each with its rate [Hz], so that they fit on the line.

        Where they do not fit at the wanted rate, what changes slowly gets SLOW_HZ at most, the others share the rest.
        """
        names = (*SHARED, IMU[kind])
        if self.line_bytes_s is None or self._load(names, self.rate_hz) <= SHARE * self.line_bytes_s:
            return dict.fromkeys(names, self.rate_hz)
        slow_hz = min(SLOW_HZ, self.rate_hz)
        quick = tuple(name for name in names if name not in SLOW)
        room = SHARE * self.line_bytes_s - self._load(SLOW, slow_hz)
        quick_hz = min(self.rate_hz, max(room / self._load(quick, 1.0), 0.1))
        return {name: slow_hz if name in SLOW else quick_hz for name in names}

    @staticmethod
    def _load(names: tuple[str, ...], rate_hz: float) -> float:
        """Return what messages take of a line at a rate, no byte of theirs cut off [B/s]."""
        return rate_hz * sum(frame_bytes(name) for name in names)


NOTHING = Wanted()


class StreamKeeper:
    """Ask for one message after another, each until it is answered: an acknowledgement does not say which it is for.

    settled: nothing waits for an answer.
    """

    def __init__(self, wanted: Wanted) -> None:
        self._wanted = wanted
        self._rates_hz: dict[str, float] = {}
        self.start_anew()

    def start_anew(self) -> None:
        """Ask for all of it again: the autopilot has only just started."""
        self._waiting = list(self._rates_hz)
        self._tries = 0
        self._asked_ns: int | None = None
        self._answers: dict[str, str] = {}
        self._seen_ns: dict[str, int] = {}
        self._settled_ns = 0

    @property
    def settled(self) -> bool:
        """Whether nothing waits for an answer."""
        return not self._waiting

    def rate_hz(self, name: str) -> float:
        """Return the rate at which a message is asked for, 0 where it is not [Hz]."""
        return self._rates_hz.get(name, 0.0)

    def take(self, message: Received) -> None:
        """Take a message of the autopilot."""
        if message.message in self._rates_hz:
            self._seen_ns[message.message] = message.arrived_ns
        if message.message == "COMMAND_ACK" and message.whole("command") == enum("MAV_CMD_SET_MESSAGE_INTERVAL"):
            self._take_answer(message)

    def due(self, peer: Peer, now_ns: int) -> Message | None:
        """Return the question that is due now, None for none."""
        if self._wanted.rate_hz <= 0.0:
            return None
        if not self._rates_hz:
            self._rates_hz = self._wanted.rates_hz(peer.autopilot)
            self._waiting = list(self._rates_hz)
        self._look_for_silent(now_ns)
        if self._asked_ns is not None:
            if now_ns - self._asked_ns < ANSWER_NS:
                return None
            if self._tries >= TRIES:
                self._conclude(UNANSWERED, now_ns)
        if not self._waiting:
            return None
        self._asked_ns = now_ns
        self._tries += 1
        name = self._waiting[0]
        return make_message(
            "COMMAND_LONG", now_ns, "streams", target_system=peer.system_id, target_component=peer.component_id,
            command=enum("MAV_CMD_SET_MESSAGE_INTERVAL"), param1=float(message_id(name)),
            param2=1e6 / self._rates_hz[name],
        )  # fmt: skip

    def __str__(self) -> str:
        """What was asked for and what came of it; "" while nothing is asked."""
        if not self._rates_hz:
            return ""
        rate_hz = max(self._rates_hz.values())
        full_hz = self._wanted.rate_hz
        narrow = "" if rate_hz >= full_hz else f" of {full_hz:g}, all that the line has room for"
        troubles = [f"{name} {answer}" for name, answer in self._answers.items() if answer]
        granted = len(self._answers) - len(troubles)
        return ", ".join((f"{granted} of {len(self._rates_hz)} at {rate_hz:.3g} Hz{narrow}", *troubles))

    def _take_answer(self, ack: Received) -> None:
        result = ack.whole("result")
        if self._asked_ns is not None and result != enum("MAV_RESULT_IN_PROGRESS"):
            self._conclude("" if result == enum("MAV_RESULT_ACCEPTED") else REFUSED, ack.arrived_ns)

    def _conclude(self, answer: str, now_ns: int) -> None:
        """Enter the answer to the question that stands."""
        self._answers[self._waiting.pop(0)] = answer
        self._asked_ns, self._tries, self._settled_ns = None, 0, now_ns

    def _look_for_silent(self, now_ns: int) -> None:
        """Ask again for what does not come and was not refused: a ground station, a reboot or a bad line stopped it."""
        if not self.settled or now_ns - self._settled_ns < REST_NS:
            return
        self._settled_ns = now_ns
        hoped_for = [name for name, answer in self._answers.items() if answer != REFUSED]
        self._waiting = [name for name in hoped_for if now_ns - self._seen_ns.get(name, 0) > SILENT_NS]
