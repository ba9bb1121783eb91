"""A flight log as the fit takes it. The one place that knows how the log spells estimates, servos and clocks."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from bridge.log import topics, triangle
from bridge.log.reader import LogReader
from bridge.log.received import RECEIVED_PREFIX, TIMESYNC
from bridge.settings.vehicle import VehicleSettings
from bridge.telemetry.logged import CONFIG_ATTACHMENT
from tools.sysid.flight_data import SHORTEST, FlightData, Track, make_sticks
from tools.sysid.servo_clock import Clock, on_stream_clock
from tools.sysid.servos import sticks_of
from tracker.errors import OperatorError
from tracker.types import Array

Flags = NDArray[np.bool_]
SHORTEST_S = 15.0
_SERVOS, _HEARTBEAT = RECEIVED_PREFIX + "SERVO_OUTPUT_RAW", RECEIVED_PREFIX + "HEARTBEAT"
_TOPICS = frozenset({topics.ESTIMATE.name, TIMESYNC.name, _SERVOS, _HEARTBEAT})
_ARMED = 128
_CLEARANCE_M = 0.15
"""Lower than so much above where it stood, the ground's cushion and its skids are not what the model knows."""

_AFTER_LIFT_S = 1.0
_GAP = 2.5
_SERVO_GAP_S = 0.15
_POOR = 5.0


@dataclass(slots=True, eq=False)
class _Raw:
    """Records of the topics that count: estimates, and (arrival, value) of servos, clocks and the armed flag."""

    estimates: list[dict[str, Any]] = field(default_factory=list)
    servos: list[dict[str, Any]] = field(default_factory=list)
    clocks: list[dict[str, Any]] = field(default_factory=list)
    armed: list[tuple[int, bool]] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class LogData:
    """What a log gives.

    clock: by which clock the servos' times came.  servo_hz: their rate.  losses: damage, in words.
    """

    data: FlightData
    vehicle: VehicleSettings
    clock: Clock
    servo_hz: float
    losses: tuple[str, ...]


def read_log(path: Path, sheet: VehicleSettings | None = None) -> LogData:
    """Read what the fit needs of a log.

    Args:
        path: a log that `run --log` or `demo` wrote.
        sheet: the vehicle's, in place of the log's own.
    Raises:
        OperatorError: no log, no sheet, no servos, or too little flight in it.
    """
    reader = LogReader(path)
    vehicle = sheet or _sheet(path, reader.attachments())
    raw = _read(reader)
    losses = tuple(map(str, reader.lost))
    if not raw.estimates:
        raise OperatorError(f"log {path}: holds no estimates; name a log of a flight")
    if not raw.servos:
        raise OperatorError(
            f"log {path}: holds no SERVO_OUTPUT_RAW, and without what the servos were told there is no model; fly with "
            "--log and [mavlink] streams_hz above 0 (docs/sysid.md)"
        )
    at_s, pulses, clock = _servo_times(path, raw, vehicle)
    sticks = make_sticks(at_s, sticks_of(pulses, vehicle))
    tracks = _tracks(raw, vehicle, at_s)
    data = FlightData(tracks, sticks)
    if data.duration_s < SHORTEST_S:
        raise OperatorError(
            f"log {path}: {data.duration_s:.1f} s in the air with servos and poses, at least {SHORTEST_S:g} s are "
            "needed; fly a plan of `posebridge excite`"
        )
    return LogData(data, vehicle, clock, (len(at_s) - 1) / float(at_s[-1] - at_s[0]), losses)


def _sheet(path: Path, attachments: dict[str, bytes]) -> VehicleSettings:
    try:
        table = orjson.loads(attachments.get(CONFIG_ATTACHMENT, b"{}")).get("vehicle")
        if table is not None:
            return VehicleSettings.model_validate(table)
    except (orjson.JSONDecodeError, ValidationError, AttributeError) as error:
        raise OperatorError(f"log {path}: its vehicle sheet cannot be read; give --config") from error
    raise OperatorError(f"log {path}: holds no [vehicle] sheet; give --config one that has it (docs/sysid.md)")


def _read(reader: LogReader) -> _Raw:
    raw = _Raw()
    for record in reader.records(_TOPICS):
        if record.topic == topics.ESTIMATE.name:
            raw.estimates.append(record.value)
        elif record.topic == TIMESYNC.name:
            raw.clocks.append(record.value)
        elif record.topic == _SERVOS:
            raw.servos.append(record.value)
        elif record.value["component_id"] == 1:
            raw.armed.append((record.value["arrived_ns"], bool(int(record.value["fields"]["base_mode"]) & _ARMED)))
    link = Counter(value["link"] for value in raw.servos).most_common(1)
    if link:
        raw.servos = [value for value in raw.servos if value["link"] == link[0][0]]
        raw.clocks = [value for value in raw.clocks if value["link"] == link[0][0]]
    return raw


def _servo_times(path: Path, raw: _Raw, vehicle: VehicleSettings) -> tuple[Array, Array, Clock]:
    """Return when each order was given by the stream's clock (n,) [s], its pulses (n, servos), and by which clock."""
    names = [f"servo{servo.channel}_raw" for servo in vehicle.servos]
    pulses = np.array([[value["fields"].get(name, 0) for name in names] for value in raw.servos], dtype=np.float64)
    silent = [name for name, column in zip(names, pulses.T, strict=True) if not column.any()]
    if silent:
        raise OperatorError(
            f"log {path}: SERVO_OUTPUT_RAW says nothing of {', '.join(silent)}; correct [[vehicle.servos]] channel"
        )
    arrived = np.array([value["arrived_ns"] for value in raw.servos], dtype=np.int64)
    stamped = np.array([value["autopilot_ns"] for value in raw.servos], dtype=np.int64)
    times, clock = on_stream_clock(arrived, stamped, raw.clocks)
    order = np.argsort(times, kind="stable")
    return np.asarray(times[order] * 1e-9, np.float64), pulses[order], clock


def _tracks(raw: _Raw, vehicle: VehicleSettings, servo_s: Array) -> tuple[Track, ...]:
    """Return the parts of the flight in the air with poses and orders, cut wherever something is missing."""
    t_s = np.array([value["t_ns"] for value in raw.estimates]) * 1e-9
    p_inW = np.array([value["p_BinW_m"] for value in raw.estimates])
    R_BtoW = Rotation.from_quat([value["q_BtoW"] for value in raw.estimates], scalar_first=True).as_matrix()
    variance = np.array(
        [[value["covariance"][k] for k in triangle.DIAGONAL[:6]] for value in raw.estimates], np.float64
    )
    sigma = np.sqrt(np.maximum(variance, 1e-12))
    whole = _airborne(raw, t_s, p_inW[:, 2]) & (np.array([value["state"] for value in raw.estimates]) == "tracking")
    whole &= np.all(sigma < _POOR * np.median(sigma, axis=0), axis=1)
    whole &= _ordered(t_s, servo_s)
    counters = np.array([value["reset_counter"] for value in raw.estimates])
    step_s = np.diff(t_s)
    cut = (step_s > _GAP * np.median(step_s)) | (step_s <= 0.0) | (np.diff(counters) != 0) | np.diff(whole)
    p_inW = p_inW + R_BtoW @ (np.array(vehicle.centre_of_mass_mm) * 1e-3)
    bounds = [0, *(np.flatnonzero(cut) + 1), len(t_s)]
    everything = Track(t_s, p_inW, np.ascontiguousarray(R_BtoW), sigma)
    parts = (everything.part(a, b) for a, b in pairwise(bounds) if whole[a])
    return tuple(part for part in parts if len(part) >= SHORTEST)


def _airborne(raw: _Raw, t_s: Array, z_m: Array) -> Flags:
    """Say of each estimate whether it is armed, clear of the ground and past the first second of its lift."""
    if not raw.armed:
        return np.ones(len(t_s), bool)
    at_s = np.array([t_ns for t_ns, _ in raw.armed]) * 1e-9
    armed = np.array([flag for _, flag in raw.armed])
    flies = armed[np.clip(np.searchsorted(at_s, t_s, side="right") - 1, 0, len(at_s) - 1)]
    if flies.all():
        return flies
    clear = flies & (z_m > np.median(z_m[~flies]) + _CLEARANCE_M)
    lifts = t_s[1:][np.diff(clear.astype(int)) == 1]
    for lift_s in lifts:
        clear &= (t_s < lift_s) | (t_s >= lift_s + _AFTER_LIFT_S)
    return np.asarray(clear)


def _ordered(t_s: Array, servo_s: Array) -> Flags:
    """Say of each estimate whether an order came shortly before it, and none is missing there."""
    newest = np.searchsorted(servo_s, t_s, side="right") - 1
    age_s = t_s - servo_s[np.maximum(newest, 0)]
    return np.asarray((newest >= 0) & (age_s < _SERVO_GAP_S))
