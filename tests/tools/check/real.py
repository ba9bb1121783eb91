"""The check rehearsed on ArduPilot's own program: the same hand holds it, through the simulator's physics interface."""

from __future__ import annotations

import math
from pathlib import Path

from bridge.ned import rotation_from_room
from tests.tools.check.rehearsal import AS_DELAYED, STEP_NS, Mistake, Rehearsal
from tools.simulate.helicopter import State
from tools.sitl.lockstep import Lockstep
from tools.sitl.process import Simulator, Wiring
from tools.sitl.radio import Transmitter, free_port
from tools.sitl.setup import parameter_file
from tools.sitl.wire import UdpWire

HOME = (32.1, 34.8, 30.0)
RADIO = (1500, 1500, 1000, 1500, 1500, 1500, 1500, 1000)
BOOT_S = 30.0
LOOP_HZ = 250
"""The program's loop: a whole number of the physics' steps."""


class Program:
    """ArduPilot's program with its three wires. folder: for its files."""

    def __init__(self, binary: Path, folder: Path, mistake: Mistake, room_yaw_deg: float) -> None:
        self._lockstep = Lockstep(rotation_from_room(math.radians(room_yaw_deg)))
        self._ground, self.bridge = UdpWire(), UdpWire()
        radio_port = free_port()
        self._radio = Transmitter(radio_port)
        self._steps = 0
        wiring = Wiring(self._lockstep.port, self._ground.port, self.bridge.port, radio_port)
        wanted = {name: value for name, value in AS_DELAYED.items() if not name.startswith("SERIAL")}
        text = parameter_file(35, {**wanted, "SCHED_LOOP_RATE": LOOP_HZ, **mistake.parameters})
        self._simulator = Simulator(binary, folder, wiring, HOME, text)

    def live(self, before: State, now: State) -> None:
        """Let it live through one step of the physics."""
        self._lockstep.servos()
        self._steps += 1
        self._radio.send(RADIO)
        dt_s = STEP_NS / 1e9
        self._lockstep.tell(self._steps * dt_s, before, now, dt_s, RADIO)

    def close(self) -> None:
        """End it."""
        self._simulator.close()
        for each in (self._lockstep, self._ground, self.bridge, self._radio):
            each.close()


class RealRehearsal(Rehearsal):
    """One check of the real program, booted half a minute ago; the simulated autopilot stays off.

    Raises:
        OperatorError: no program there.
    """

    def __init__(self, binary: Path, folder: Path, mistake: Mistake, room_yaw_deg: float = 30.0) -> None:
        self._program = Program(binary, folder, mistake, room_yaw_deg)
        super().__init__(mistake, room_yaw_deg)
        self._wire.close()
        self._wire = self._program.bridge
        for _ in range(round(BOOT_S * 1e9 / STEP_NS)):
            self._live()
            self._wire.receive()

    def check(self, **asked: bool) -> bool:
        """Check it all, end the program, and say whether it passed."""
        try:
            return super().check(**asked)
        finally:
            self._program.close()

    def _talk(self) -> None:
        for _ in range(len(self._link.frames)):
            self._wire.send(self._link.frames.popleft())
        self._live()
        for datagram in self._wire.receive():
            self._link.deliver(datagram)

    def _live(self) -> None:
        """Let the program live through one step."""
        self._program.live(self._course.back(1), self._course.back(0))
