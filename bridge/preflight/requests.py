"""What the check asks of an autopilot beside its parameters: who it is, message rates, its own checks."""

from __future__ import annotations

from collections.abc import Mapping

from bridge.dialect import enum, make_message, message_id
from bridge.dialogue.peer import Autopilot, Peer
from bridge.wire import Message

AGAIN_NS = 2_000_000_000
EVERY_NS = 60_000_000  # a telemetry radio takes about so long for a command and its answer
VERSION = "AUTOPILOT_VERSION"
POSITION, ATTITUDE = "LOCAL_POSITION_NED", "ATTITUDE"
STATUS: Mapping[Autopilot, str] = {Autopilot.ARDUPILOT: "EKF_STATUS_REPORT", Autopilot.PX4: "ESTIMATOR_STATUS"}
GYRO: Mapping[Autopilot, str] = {Autopilot.ARDUPILOT: "RAW_IMU", Autopilot.PX4: "HIGHRES_IMU"}
GYRO_HZ = 50.0


def rates(autopilot: Autopilot, gyro: bool) -> dict[str, float]:
    """Return the messages to ask for and how often [Hz]. gyro: for a wiggle."""
    wanted = {POSITION: 10.0, ATTITUDE: 10.0}
    if autopilot in STATUS:
        wanted[STATUS[autopilot]] = 2.0
    if gyro and autopilot in GYRO:
        wanted[GYRO[autopilot]] = GYRO_HZ
    return wanted


class Requests:
    """Ask one thing at a time, again until it comes.

    peer: whom to ask.
    """

    def __init__(self, peer: Peer) -> None:
        self._peer = peer
        self._rates: dict[str, float] = {}
        self._asked_ns: dict[str, int] = {}
        self._heard: set[str] = set()
        self._last_ns: int | None = None
        self._checks_wanted = False

    def want(self, wanted: Mapping[str, float]) -> None:
        """Ask for these messages at these rates [Hz], in place of those asked for before."""
        for name, rate_hz in wanted.items():
            if self._rates.get(name) != rate_hz:
                self._asked_ns.pop(name, None)
                self._heard.discard(name)
        self._rates = dict(wanted)

    def want_checks(self) -> None:
        """Let it say once, now, what keeps it from arming: it does so by itself only every half minute."""
        self._checks_wanted = True

    def take(self, name: str) -> None:
        """Take note that a message of this name has come."""
        if name in self._asked_ns:
            self._heard.add(name)

    def due(self, now_ns: int) -> Message | None:
        """Return what to ask now, None for nothing."""
        if self._last_ns is not None and now_ns - self._last_ns < EVERY_NS:
            return None
        for name in (VERSION, *self._rates):
            asked_ns = self._asked_ns.get(name)
            if name not in self._heard and (asked_ns is None or now_ns - asked_ns >= AGAIN_NS):
                self._asked_ns[name] = self._last_ns = now_ns
                return self._once(now_ns) if name == VERSION else self._interval(name, 1e6 / self._rates[name], now_ns)
        if self._checks_wanted:
            self._checks_wanted, self._last_ns = False, now_ns
            return self._command("MAV_CMD_RUN_PREARM_CHECKS", now_ns)
        return None

    def farewell(self, now_ns: int) -> list[Message]:
        """Return what gives the messages their usual rates back."""
        return [self._interval(name, 0.0, now_ns) for name in self._rates]

    def _once(self, now_ns: int) -> Message:
        return self._command("MAV_CMD_REQUEST_MESSAGE", now_ns, float(message_id(VERSION)))

    def _interval(self, name: str, interval_us: float, now_ns: int) -> Message:
        return self._command("MAV_CMD_SET_MESSAGE_INTERVAL", now_ns, float(message_id(name)), interval_us)

    def _command(self, command: str, now_ns: int, *values: float) -> Message:
        parameters = {f"param{k + 1}": value for k, value in enumerate(values)}
        return make_message(
            "COMMAND_LONG", now_ns, f"{command} {values}", target_system=self._peer.system_id,
            target_component=self._peer.component_id, command=enum(command), **parameters,
        )  # fmt: skip
