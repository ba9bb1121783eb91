"""The two autopilots that a simulated flight can have: ArduPilot's own program, and the project's simulated one."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from bridge.ned import rotation_from_room
from tools.simulate.autopilot.imu import Imu, ImuNoise
from tools.simulate.autopilot.vessel import Autopilot
from tools.simulate.course import Course
from tools.simulate.helicopter import Sticks
from tools.simulate.world import wired
from tools.sitl.airframe import sticks_of
from tools.sitl.lockstep import Lockstep
from tools.sitl.radio import Transmitter
from tools.sitl.world import STEP_NS, TICK_STEPS

Radio = Callable[[], tuple[int, ...]]
"""Channels 1 to 8 of the radio now [us]."""


class ArduPilot:
    """The real program, through its physics interface.

    start_ns: simulated time at which its own begins.  port: where it looks for its physics, 0 for any that is free.
    radio_port: where it listens for its radio.
    """

    def __init__(self, room_yaw_deg: float, radio: Radio, start_ns: int, port: int, radio_port: int) -> None:
        self._lockstep = Lockstep(rotation_from_room(math.radians(room_yaw_deg)), port)
        self._transmitter = Transmitter(radio_port)
        self._radio = radio
        self._start_ns = start_ns
        self._steps = 0
        self.port = self._lockstep.port

    def sticks(self, now_ns: int, course: Course) -> Sticks:
        """Wait for its servos, then tell it of the step that is over."""
        pwm = self._lockstep.servos()
        t_s = (now_ns - self._start_ns) / 1e9 + STEP_NS / 1e9
        rc_us = self._radio()
        if self._steps % TICK_STEPS == 0:
            self._transmitter.send(rc_us)
        self._steps += 1
        self._lockstep.tell(t_s, course.back(1), course.back(0), STEP_NS / 1e9, rc_us)
        return sticks_of(pwm)

    def close(self) -> None:
        """Close the interface, and switch the radio off."""
        self._lockstep.close()
        self._transmitter.close()


class Own:
    """The simulated autopilot, commanded over MAVLink as the real one is; just switched on at start_ns."""

    def __init__(self, parameters: Mapping[str, float], start_ns: int) -> None:
        self._autopilot = Autopilot(None, parameters, booted_ns=start_ns, ports=2)
        self._imu = Imu(ImuNoise(), np.random.default_rng(2))
        self._sticks = Sticks()
        self._steps = 0
        self.bridge_port, self.ground_port = (port.number for port in self._autopilot.ports)

    def sticks(self, now_ns: int, course: Course) -> Sticks:
        """Let it do its rounds, fifty a second."""
        if self._steps % TICK_STEPS == 0:
            increment = self._imu.read(course.back(TICK_STEPS), course.back(0), TICK_STEPS * STEP_NS / 1e9)
            self._sticks = wired(self._autopilot.tick(now_ns, increment))
        self._steps += 1
        return self._sticks

    def close(self) -> None:
        """Let go of its ports."""
        self._autopilot.close()
