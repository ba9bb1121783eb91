"""ArduPilot's simulator interface `--model JSON`: it asks for physics, and waits until it gets them.

Source: libraries/SITL/SIM_JSON.cpp and SITL's JSON examples: servo packets of u16 magic 18458, u16 rate, u32 frame,
u16 pwm[16], answered by a line of JSON. The same frame number again means it did not hear the answer.
"""

from __future__ import annotations

import json
import socket
import struct

import numpy as np

from tools.simulate.autopilot.imu import FLIP
from tools.simulate.dynamics import GRAVITY
from tools.simulate.helicopter import State
from tracker.errors import OperatorError
from tracker.maths import so3
from tracker.types import Array

_PACKET = struct.Struct("<HHI16H")
_MAGIC = 18458
_GRAVITY_inW = np.array([0.0, 0.0, -GRAVITY])
_SILENCE_S = 15.0

PHYSICS_PORT = 9002
"""Where a simulator looks for its physics unless told otherwise."""


class Lockstep:
    """The physics' end of the wire, on loopback.

    R_WtoN: (3, 3), where north is in the room.  port: 0 for any that is free.
    """

    def __init__(self, R_WtoN: Array, port: int = 0) -> None:
        """Listen for the simulator.

        Raises:
            OperatorError: the port is taken.
        """
        self._R_WtoN = R_WtoN
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind(("127.0.0.1", port))
        except OSError as error:
            self._socket.close()
            raise OperatorError(
                f"sitl: the physics' port {port} is taken ({error.strerror}); end the other program"
            ) from error
        self._socket.settimeout(_SILENCE_S)
        self._peer: tuple[str, int] | None = None
        self._frame: int | None = None
        self._answer = b""
        self.port = int(self._socket.getsockname()[1])

    def servos(self) -> tuple[int, ...]:
        """Wait for the next servo outputs [us], sixteen of them.

        Raises:
            OperatorError: nothing came for long: the simulator has died, or speaks another protocol; or one whose
                clock is not at its beginning.
        """
        while True:
            try:
                data, self._peer = self._socket.recvfrom(256)
            except TimeoutError as error:
                raise OperatorError(
                    f"sitl: no servo packet within {_SILENCE_S:g} s; see what the simulator printed (sitl.out), "
                    "or start it with --model JSON:127.0.0.1"
                ) from error
            if len(data) != _PACKET.size:
                continue
            magic, _, frame, *pwm = _PACKET.unpack(data)
            if magic != _MAGIC:
                continue
            if frame == self._frame:
                self._socket.sendto(self._answer, self._peer)
                continue
            if self._frame is None and frame > 0:
                raise OperatorError(
                    f"sitl: the simulator has flown before (its physics' step {frame}, not 0) and keeps its clock; "
                    "start it anew"
                )
            self._frame = frame
            return tuple(pwm)

    def tell(self, t_s: float, before: State, now: State, dt_s: float, rc_us: tuple[int, ...]) -> None:
        """Answer with the state now: exact pose and velocity, and what an IMU felt since the state before."""
        self._answer = line_of(self._R_WtoN, t_s, before, now, dt_s, rc_us)
        if self._peer is not None:
            self._socket.sendto(self._answer, self._peer)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


def line_of(R_WtoN: Array, t_s: float, before: State, now: State, dt_s: float, rc_us: tuple[int, ...]) -> bytes:
    """Write a state as a line for the simulator: north-east-down and forward-right-down, SI units."""
    acceleration = (now.v_BinW - before.v_BinW) / dt_s
    force_inF = FLIP * (now.R_BtoW.T @ (acceleration - _GRAVITY_inW))
    q_FtoN = so3.quaternion(R_WtoN @ now.R_BtoW * FLIP)
    state = {
        "timestamp": t_s,
        "imu": {"gyro": (FLIP * now.w_BinB).tolist(), "accel_body": force_inF.tolist()},
        "position": (R_WtoN @ now.p_BinW).tolist(),
        "quaternion": q_FtoN.tolist(),
        "velocity": (R_WtoN @ now.v_BinW).tolist(),
        "rc": {f"rc_{k + 1}": us for k, us in enumerate(rc_us)},
    }
    return b"\n" + json.dumps(state, separators=(",", ":")).encode() + b"\n"
