"""The delay of a wiggle, out of what autopilot and bridge said of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bridge.dialogue import DialogueState
from bridge.preflight import ardupilot
from bridge.preflight.clockwork import our_times
from bridge.preflight.delay import Delay, TooLittle, find_delay
from bridge.preflight.hearing import Hearing
from bridge.preflight.parameters import Parameter
from bridge.preflight.poses import Pose
from bridge.preflight.requests import GYRO
from bridge.wire import Received
from tracker.types import Array

_MILLI = 1e-3


def wiggled(hearing: Hearing, poses: Sequence[Pose], far: DialogueState | None, since_ns: int) -> Delay | TooLittle:
    """Find by how much the poses' stamps are late, by the gyro's messages from an instant on [ns]."""
    name = None if far is None or far.peer is None else GYRO.get(far.peer.autopilot)
    if far is None or name is None:
        return TooLittle("this autopilot's gyro message is not known")
    if far.sync is None:
        return TooLittle("its clock is not known: it answers no TIMESYNC within 10 ms; use a wire for this")
    readings = hearing.since(name, since_ns)
    if not readings:
        return TooLittle(f"it sends no {name}")
    rates = [_rate(reading) for reading in readings]
    return find_delay(
        [pose.t_ns for pose in poses], [pose.R_FtoN for pose in poses], our_times(readings, far.sync), rates
    )


def gyro_lag_s(known: Mapping[str, Parameter]) -> float:
    """Return by how much the reported gyro lags [s]: ArduPilot's is filtered, PX4's HIGHRES_IMU is not."""
    filtered = known.get(ardupilot.GYRO_FILTER)
    return 0.0 if filtered is None else ardupilot.gyro_lag_s(filtered.value)


def _rate(reading: Received) -> Array:
    """Return the gyro's reading (3,) [rad/s]: HIGHRES_IMU is in rad/s, RAW_IMU of ArduPilot in thousandths of it."""
    scale = 1.0 if reading.message == "HIGHRES_IMU" else _MILLI
    return scale * np.array([reading.number(axis) for axis in ("xgyro", "ygyro", "zgyro")])
