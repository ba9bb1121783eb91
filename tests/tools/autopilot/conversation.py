"""Talk with a simulated autopilot over its real port, in its own time: no world, it stands still."""

from __future__ import annotations

import socket
from collections.abc import Mapping
from types import TracebackType
from typing import Self

import numpy as np

from bridge.dialect import Encoder, Identity, Reader, make_message
from bridge.wire import FieldValue, Received
from tools.simulate.autopilot.imu import Increment
from tools.simulate.autopilot.parameters import FOR_VISION
from tools.simulate.autopilot.vessel import Autopilot
from tools.simulate.dynamics import GRAVITY

TICK_NS = 20_000_000
STANDING = Increment(0.02, np.zeros(3), np.array([0.0, 0.0, -0.02 * GRAVITY]))
LATITUDE, LONGITUDE, ALTITUDE_MM = 473_978_000, 85_456_000, 488_000


class Conversation:
    """An autopilot that was just switched on, and one who speaks to it as the bridge does."""

    def __init__(
        self, parameters: Mapping[str, float] = FOR_VISION, system_id: int = 1, component_id: int = 197
    ) -> None:
        self.autopilot = Autopilot(None, parameters, booted_ns=0)
        self.now_ns = 0
        self.heard: list[Received] = []
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.connect(("127.0.0.1", self.autopilot.port))
        self._encode = Encoder(Identity(system_id, component_id))
        self._reader = Reader()

    def say(self, name: str, **fields: FieldValue) -> None:
        """Send one message."""
        self._socket.send(self._encode(make_message(name, self.now_ns, **fields), 0))

    def command(self, number: int, *values: float) -> int:
        """Send a COMMAND_LONG and return the MAV_RESULT that comes back."""
        parameters = {f"param{k + 1}": float(value) for k, value in enumerate(values)}
        self.say("COMMAND_LONG", target_system=1, target_component=1, command=number, **parameters)
        return int(str(self._answer("COMMAND_ACK")["result"]))

    def set_origin(self, latitude: int = LATITUDE, longitude: int = LONGITUDE) -> int:
        """Send MAV_CMD_DO_SET_GLOBAL_ORIGIN and return the MAV_RESULT that comes back."""
        self.say("COMMAND_INT", target_system=1, target_component=1, command=611, x=latitude, y=longitude, z=488.0)
        return int(str(self._answer("COMMAND_ACK")["result"]))

    def request(self, message_id: int, name: str) -> Mapping[str, FieldValue]:
        """Ask for one message and return its fields; empty where there is none."""
        self.say("COMMAND_LONG", target_system=1, target_component=1, command=512, param1=float(message_id))
        return self._answer(name)

    def wait(self, until_s: float, vision: bool = False) -> None:
        """Let time go on to so many seconds after boot, with or without poses, 15 a second."""
        while self.now_ns < until_s * 1e9:
            if vision and self.now_ns // TICK_NS % 3 == 0:
                self.pose()
            self.tick()

    def pose(self, x: float = 0.0, stamp_ns: int | None = None, **fields: FieldValue) -> None:
        """Send a pose and a standing velocity, both stamped now or as told."""
        usec = (self.now_ns if stamp_ns is None else stamp_ns) // 1000 + 1
        self.say("VISION_POSITION_ESTIMATE", usec=usec, x=x, **fields)
        self.say("VISION_SPEED_ESTIMATE", usec=usec, **fields)

    def tick(self) -> None:
        """Let one round pass and hear what is said."""
        self.now_ns += TICK_NS
        self.autopilot.tick(self.now_ns, STANDING)
        while True:
            try:
                self.heard += self._reader.feed(self._socket.recv(65535))
            except BlockingIOError:
                return

    def texts(self) -> list[str]:
        """Return every STATUSTEXT heard."""
        return [str(each.fields["text"]) for each in self.heard if each.message == "STATUSTEXT"]

    def _answer(self, name: str) -> Mapping[str, FieldValue]:
        before = len(self.heard)
        self.tick()
        return next((each.fields for each in self.heard[before:] if each.message == name), {})

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._socket.close()
        self.autopilot.close()
