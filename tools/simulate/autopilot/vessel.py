"""The autopilot as a whole: it flies on what arrives at its ports and on its own IMU, and on nothing else."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import StrEnum

import numpy as np

from bridge.dialect import Identity, enum, make_message
from bridge.pack import HEARTBEAT
from tools.simulate.autopilot import requests
from tools.simulate.autopilot.arming import refusals
from tools.simulate.autopilot.failsafe import EkfFailsafe
from tools.simulate.autopilot.guided import Guided
from tools.simulate.autopilot.imu import Increment
from tools.simulate.autopilot.navigation import Navigation, NavState
from tools.simulate.autopilot.origins import Origin
from tools.simulate.autopilot.parameters import FOR_VISION, Parameters
from tools.simulate.autopilot.port import Port
from tools.simulate.autopilot.reports import GUIDED, LAND, Snapshot, report
from tools.simulate.autopilot.vision import VisionSensor
from tools.simulate.control import Cascade, PilotSticks, Tuning, added
from tools.simulate.mission import Phase, Reference

VISION_COMPONENT = 197
"""MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY: the mission waits for its heartbeat, as an operator looks for it."""

SYSTEM, AUTOPILOT_COMPONENT = 1, 1
BOOTED_NS = -7_654_321_000
"""World time at which it was switched on: by the start it is up and its filter runs."""

_ARMING_NS = 500_000_000
_PREARM_NS = 30_000_000_000
_SINK = -0.12
_NO_INCREMENT = Increment(0.02, np.zeros(3), np.array([0.0, 0.0, -0.2]))


class Mode(StrEnum):
    """What the autopilot does."""

    WAITING = "waiting"  # on the ground, disarmed
    FLYING = "flying"  # guided: by the mission, or by who commands
    LANDING = "landing"  # down, by position if there is one, else level
    LANDED = "landed"


class Autopilot:
    """Listen, navigate, fly.

    mission: reference in north-east-down by the time since arming [s]; None to be commanded over MAVLink instead. With
        a mission it arms by itself as soon as it may and the bridge's heartbeat is there.
    parameters: what an operator has set; the rest are ArduPilot's defaults.
    origin: one that its ground station gives it as soon as its filter runs; None if others must.
    booted_ns: world time at which it was switched on [ns]. Its clock counts from there; no one tells it the bridge's.
    ports: how many; the first is the bridge's. What comes by one is passed on to the others, as ArduPilot does.
    excitation: sticks added to its own by the time since arming [s], while it flies its mission.
    """

    def __init__(
        self,
        mission: Callable[[float], Reference] | None,
        parameters: Mapping[str, float] = FOR_VISION,
        *,
        origin: Origin | None = None,
        booted_ns: int = BOOTED_NS,
        ports: int = 1,
        tuning: Tuning | None = None,
        excitation: Callable[[float], PilotSticks] | None = None,
    ) -> None:
        self._excitation = excitation
        self._tuning = tuning or Tuning()
        self._mission = mission
        self._origin = origin
        self._booted_ns = booted_ns
        self.ports = [Port(Identity(SYSTEM, AUTOPILOT_COMPONENT)) for _ in range(ports)]
        self.parameters = Parameters(parameters)
        self._start()

    def _start(self) -> None:
        """Begin anew, as after a reboot; parameters stay."""
        self._cascade = Cascade(self._tuning)
        self._failsafe = EkfFailsafe()
        self._guided = Guided()
        self._state: NavState | None = None
        self._increment = _NO_INCREMENT
        self._given = PilotSticks()
        self._shift_inN = self._shift_armed_inN = np.zeros(3)
        self._now_ns = 0
        self._heard = False
        self._ready_since_ns: int | None = None
        self._prearm_due_ns = _PREARM_NS
        self._texts: list[str] = []
        self.navigation = Navigation(self.parameters)
        self.vision = VisionSensor(self.parameters)
        self.mode = Mode.WAITING
        self.mission_s = 0.0

    @property
    def port(self) -> int:
        """The bridge's UDP port on 127.0.0.1."""
        return self.ports[0].number

    @property
    def armed(self) -> bool:
        """Say whether it is armed."""
        return self.mode in (Mode.FLYING, Mode.LANDING)

    def hear(self, world_ns: int) -> None:
        """Read what has come and answer what is asked, between two rounds as well. world_ns: drives its clock [ns]."""
        self._now_ns = world_ns - self._booted_ns
        for port in self.ports:
            self._listen(port)

    def tick(self, world_ns: int, increment: Increment) -> PilotSticks:
        """Do one round: read what has come, navigate, decide, tell, and return the sticks.

        Args:
            world_ns: drives its clock [ns].
            increment: what its IMU summed up since the last tick.
        """
        self.hear(world_ns)
        self._increment = increment
        self.navigation.flies = self.armed
        self.navigation.advance(self._now_ns // 1_000_000, increment)
        self._state = self.navigation.state_now()
        self._go_along()
        if self._origin is not None and self.navigation.runs and self.navigation.origin is None:
            self.set_origin(self._origin)
        self._decide()
        self._given = self._sticks(increment.dt_s)
        self._tell()
        return self._given

    def _go_along(self) -> None:
        """Move the target with a jump of the filter."""
        jump_inN, self._shift_inN = self.navigation.shift_inN - self._shift_inN, self.navigation.shift_inN
        if self._state is not None and self.armed and jump_inN.any():
            self._guided.rebase(jump_inN, self._state)

    def reference(self) -> Reference:
        """Return what is to be flown now, moved along with the filter's own jumps since it was armed."""
        if self._mission is None:
            return self._guided.reference()
        wanted = self._mission(self.mission_s)
        shift = self.navigation.shift_inN - self._shift_armed_inN
        return Reference(wanted.phase, wanted.p + shift, wanted.v, wanted.a, wanted.yaw, wanted.yaw_rate)

    def snapshot(self) -> Snapshot:
        """Return how it stands now."""
        mode = LAND if self.mode is Mode.LANDING else GUIDED
        return Snapshot(self._now_ns, self.armed, mode, self.navigation, self._state, self._increment, self._given)

    def set_origin(self, origin: Origin) -> bool:
        """Set the filter's origin; say whether it was taken."""
        return self.navigation.set_origin(origin)

    def refusals(self) -> list[str]:
        """Return why it does not arm."""
        healthy = self.vision.healthy(self._now_ns // 1_000_000)
        errors = ["Internal errors 0x400 l:66 cnst_nan"] if self.vision.met_nan else []
        return errors + list(refusals(self.parameters, self.navigation, healthy))

    def command(self, number: int, values: tuple[float, ...]) -> int | None:
        """Do a command; None for one not known."""
        if number == enum("MAV_CMD_COMPONENT_ARM_DISARM"):
            return self._arm() if values[0] == 1 else self._disarm()
        if number == enum("MAV_CMD_NAV_TAKEOFF"):
            if self.mode is not Mode.FLYING or self.navigation.origin is None or self._state is None:
                return requests.FAILED
            self._guided.climb_to(values[6])
            return requests.ACCEPTED
        if number == enum("MAV_CMD_DO_SET_MODE"):
            return self._set_mode(round(values[1]))
        if number == enum("MAV_CMD_RUN_PREARM_CHECKS"):
            return self._run_checks()
        if number == enum("MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN") and values[0] == 1 and not self.armed:
            self._booted_ns += self._now_ns
            for port in self.ports:
                port.restart()
            self._start()
            return requests.ACCEPTED
        return None

    def close(self) -> None:
        """Let go of the ports."""
        for port in self.ports:
            port.close()

    def _listen(self, port: Port) -> None:
        for message in port.receive():
            if (message.system_id, message.component_id) == (SYSTEM, AUTOPILOT_COMPONENT):
                continue  # its own voice come back
            for other in self.ports:
                if other is not port:
                    other.forward(message.raw)
            self._heard |= message.message == HEARTBEAT and message.component_id == VISION_COMPONENT
            erred = self.vision.met_nan
            samples = self.vision.take(message, self._now_ns // 1000, port.clock, self.navigation.runs)
            self._texts += ["Internal Errors 0x400"] * (self.vision.met_nan and not erred)
            self.navigation.take(samples)
            if self._mission is None and message.message == "SET_POSITION_TARGET_LOCAL_NED":
                self._guided.go_to(message.fields)
            requests.answer(message, port, self, SYSTEM)

    def _decide(self) -> None:
        """Go on to the mode that health and mission call for."""
        if self.mode is Mode.WAITING:
            self._guided.stand_at(self._state)
            self._wait()
            return
        text = self._failsafe.look(
            self._now_ns // 1_000_000,
            self.navigation.variances,
            self.navigation.aided,
            self.parameters["FS_EKF_THRESH"],
        )
        if text is not None:
            self._texts.append(text)
        if self.mode is Mode.FLYING:
            if self._failsafe.acts and self.parameters["FS_EKF_ACTION"] != 0:
                self.mode = Mode.LANDING
                self._texts.append("EKF Failsafe: changed to LAND Mode")
            elif self.reference().phase is Phase.DONE:
                self.mode = Mode.LANDED
        elif self.mode is Mode.LANDING and self._guided.is_down(self._state):
            self._disarm()

    def _wait(self) -> None:
        """Arm for the mission once nothing has been against it for a while."""
        reasons = self.refusals()
        self._ready_since_ns = None if reasons else (self._ready_since_ns or self._now_ns)
        if reasons and self._now_ns >= self._prearm_due_ns:
            self._texts += [f"PreArm: {reason}" for reason in reasons]
        if self._now_ns >= self._prearm_due_ns:
            self._prearm_due_ns += _PREARM_NS
        steady = self._ready_since_ns is not None and self._now_ns - self._ready_since_ns >= _ARMING_NS
        if self._mission is not None and self._heard and steady:
            self._arm()

    def _arm(self) -> int:
        reasons = self.refusals()
        if reasons or self.mode is Mode.LANDED:
            self._texts += [f"Arm: {reason}" for reason in reasons]
            return requests.FAILED
        self.mode = Mode.FLYING
        self._shift_armed_inN = self.navigation.shift_inN
        self._texts.append("Arming motors")
        return requests.ACCEPTED

    def _run_checks(self) -> int:
        """Say at once what keeps it from arming; refused when armed."""
        if self.armed:
            return requests.FAILED
        self._texts += [f"PreArm: {reason}" for reason in self.refusals()]
        return requests.ACCEPTED

    def _disarm(self) -> int:
        if self.mode in (Mode.FLYING, Mode.LANDING):
            self.mode = Mode.LANDED
            self._texts.append("Disarming motors")
        return requests.ACCEPTED

    def _set_mode(self, number: int) -> int:
        if number == LAND and self.armed:
            self.mode = Mode.LANDING
            self._guided.descend()
        return requests.ACCEPTED if number in (GUIDED, LAND) else requests.FAILED

    def _tell(self) -> None:
        texts = self.navigation.texts + self._texts
        self.navigation.texts, self._texts = [], []
        now = self.snapshot()
        for port in self.ports:
            for text in texts:
                port.send(make_message("STATUSTEXT", now.now_ns, severity=_severity(text), text=text))
            for name in port.due(now.now_ns):
                message = report(name, now)
                if message is not None:
                    port.send(message)

    def _sticks(self, dt_s: float) -> PilotSticks:
        if not self.armed:
            return PilotSticks()
        lands = self.mode is Mode.LANDING
        if self._state is None or (lands and (self._mission is not None or not self.navigation.aided)):
            return self._cascade.level(_SINK if lands else 0.0)
        self.mission_s += dt_s
        self._guided.advance(dt_s)
        sticks = self._cascade.fly(self.reference(), self._state, dt_s)
        return sticks if self._excitation is None else added(sticks, self._excitation(self.mission_s))


def _severity(text: str) -> int:
    failed = text.startswith(("PreArm", "Arm:", "EKF variance", "EKF Failsafe"))
    return enum("MAV_SEVERITY_CRITICAL" if failed else "MAV_SEVERITY_INFO")
