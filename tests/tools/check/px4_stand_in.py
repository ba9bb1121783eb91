"""What PX4 says and answers, as its documentation has it: no filter, it believes what ODOMETRY tells.

Stands where the simulated autopilot stands in a rehearsal.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from bridge.dialect import Identity, enum, make_message
from bridge.wire import FieldValue, Message, Received
from tools.simulate.autopilot.imu import Increment
from tools.simulate.autopilot.port import Port
from tools.simulate.autopilot.reports import NUMBERS

INT32, REAL32 = 6, 9
EV_CTRL, ALL = "EKF2_EV_CTRL", 15
RIGHT: Mapping[str, float | int] = {
    "EKF2_EV_CTRL": 15, "EKF2_EV_DELAY": 0.0, "EKF2_HGT_REF": 3, "EKF2_GPS_CTRL": 0, "EKF2_MAG_TYPE": 5,
    "SYS_HAS_GPS": 0, "SYS_HAS_MAG": 0, "EKF2_EV_QMIN": 0, "EKF2_EV_NOISE_MD": 0, "EKF2_EVP_NOISE": 0.05,
    "EKF2_EVV_NOISE": 0.05, "EKF2_EVA_NOISE": 0.05, "MAV_1_CONFIG": 102, "SER_TEL2_BAUD": 921600,
}  # fmt: skip
FUSING: Mapping[str, FieldValue] = {"flags": 0x1FF, "vel_ratio": 0.05}
BLIND: Mapping[str, FieldValue] = {"flags": 0xE5, **dict.fromkeys(("vel_ratio", "pos_horiz_ratio"), math.nan)}
"""ESTIMATOR_STATUS of PX4 1.17 at rest, as its own program sent it: with poses, and without."""

_NAMES = {**NUMBERS} | {enum(f"MAVLINK_MSG_ID_{name}"): name for name in ("HIGHRES_IMU", "ESTIMATOR_STATUS")}


class StandIn:
    """One PX4. parameters: whole numbers are INT32, the rest floats, as PX4 keeps them."""

    def __init__(self, parameters: Mapping[str, float | int], booted_ns: int) -> None:
        self._port = Port(Identity(1, 1))
        self._booted_ns = booted_ns
        self._now_ns = 0
        self._increment = Increment(0.02, np.zeros(3), np.zeros(3))
        self._pose: Mapping[str, FieldValue] | None = None
        self.parameters = {**RIGHT, **parameters}
        self.port = self._port.number

    def hear(self, world_ns: int) -> None:
        """Read and answer."""
        self._now_ns = world_ns - self._booted_ns
        for message in self._port.receive():
            if message.message == "ODOMETRY":
                self._pose = message.fields
            for answer in self._answers(message):
                self._port.send(answer)

    def tick(self, world_ns: int, increment: Increment) -> None:
        """Do a round."""
        self._increment = increment
        self.hear(world_ns)
        for name in self._port.due(self._now_ns):
            fields = self._report(name)
            if fields is not None:
                self._port.send(make_message(name, self._now_ns, **fields))

    def close(self) -> None:
        """Let go of the port."""
        self._port.close()

    def _answers(self, message: Received) -> list[Message]:
        fields = message.fields
        if message.message == "TIMESYNC" and fields["tc1"] == 0:
            return [make_message("TIMESYNC", 0, tc1=self._now_ns, ts1=fields["ts1"])]
        if message.message in ("PARAM_REQUEST_READ", "PARAM_SET") and fields["param_id"] in self.parameters:
            name = str(fields["param_id"])
            if message.message == "PARAM_SET":
                layout = "<i" if message.whole("param_type") == INT32 else "<f"
                (self.parameters[name],) = struct.unpack(layout, message.raw[10:14])
            return [self._value(name)]
        if message.message == "COMMAND_LONG":
            return self._command(message)
        return []

    def _command(self, message: Received) -> list[Message]:
        number, name = message.whole("command"), _NAMES.get(round(message.number("param1")), "")
        told = []
        if number == enum("MAV_CMD_SET_MESSAGE_INTERVAL"):
            self._port.wanted[name] = round(1000 * message.number("param2")) or 10**9
        elif number == enum("MAV_CMD_REQUEST_MESSAGE") and name == "AUTOPILOT_VERSION":
            told = [make_message(name, 0, flight_sw_version=1 << 24 | 15 << 16 | 4 << 8 | 255)]
        return [make_message("COMMAND_ACK", 0, command=number, result=0), *told]

    def _value(self, name: str) -> Message:
        value = self.parameters[name]
        whole = isinstance(value, int)
        (as_float,) = struct.unpack("<f", struct.pack("<i" if whole else "<f", value))
        kind = INT32 if whole else REAL32
        return make_message("PARAM_VALUE", 0, param_id=name, param_value=as_float, param_type=kind, param_count=20)

    def _report(self, name: str) -> dict[str, FieldValue] | None:
        time: dict[str, FieldValue] = {"time_boot_ms": self._now_ns // 1_000_000}
        if name == "HEARTBEAT":
            return {"type": 2, "autopilot": enum("MAV_AUTOPILOT_PX4"), "mavlink_version": 3}
        if name == "HIGHRES_IMU":
            rates = (self._increment.turn_inF / self._increment.dt_s).tolist()
            return {"time_usec": self._now_ns // 1000, **dict(zip(("xgyro", "ygyro", "zgyro"), rates, strict=True))}
        pose = self._pose if self.parameters[EV_CTRL] == ALL else None
        if name == "ESTIMATOR_STATUS":
            return {"time_usec": self._now_ns // 1000, **(BLIND if pose is None else FUSING)}
        if pose is None:
            return None
        if name == "LOCAL_POSITION_NED":
            return time | {axis: pose[axis] for axis in ("x", "y", "z")}
        if name == "ATTITUDE":
            w, x, y, z = np.array(pose["q"])
            yaw, pitch, roll = Rotation.from_quat([x, y, z, w]).as_euler("ZYX")
            return time | {"roll": float(roll), "pitch": float(pitch), "yaw": float(yaw)}
        return None
