"""Logs of synthetic flights, written by the real recorder."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bridge.dialogue.timesync import SyncState
from bridge.heard import Heard
from bridge.log.reader import LogReader
from bridge.recorder import Recorder
from bridge.settings import load_settings
from bridge.wire import Received
from tests.bridge.estimates import estimate
from tests.bridge.recordings import cameras, marker
from tools.sysid.flight_data import FlightData
from tracker.types import Step, TrackState

LINK = "udpout:127.0.0.1:14550"
BOOT_NS = -4_000_000_000
"""Stream time at which the autopilot was switched on."""


@dataclass(frozen=True, slots=True)
class Writing:
    """What the log is to hold. reset_at: index of an estimate that jumps; None for none.  late_ms: of each message."""

    sheet: bool = True
    servos: bool = True
    timesync: bool = True
    late_ms: float = 3.0
    reset_at: int | None = None


def write_log(path: Path, data: FlightData, writing: Writing) -> Path:
    """Write a flight's estimates and servo messages in the order of their times."""
    (track,) = data.tracks
    lab = load_settings("lab").vehicle
    assert lab is not None
    config = {"vehicle": lab.model_dump(mode="json")} if writing.sheet else {}
    recorder = Recorder(
        path,
        attachments={"config.json": json.dumps(config).encode()},
        metadata={},
        cameras=cameras(),
        marker=marker(),
        wall_clock=lambda: 0,
        block_when_full=True,
    )
    turns: list[tuple[int, Step, Heard]] = []
    for k, t_s in enumerate(track.t_s):
        covariance = np.diag(np.concatenate((track.sigma[k] ** 2, np.full(6, 1e-4))))
        made = estimate(_ns(t_s), track.p_inW[k], track.R_BtoW[k], covariance=covariance)
        jumped = writing.reset_at is not None and k >= writing.reset_at
        step = Step(TrackState.TRACKING, estimates=(replace(made, reset_counter=int(jumped)),))
        turns.append((_ns(t_s), step, Heard()))
    for t_s, held in zip(data.sticks.at_s, data.sticks.held, strict=True):
        turns.append((_ns(t_s), Step(TrackState.TRACKING), _heard(_ns(t_s), held, writing)))
    with recorder:
        for now_ns, step, heard in sorted(turns, key=lambda turn: turn[0]):
            recorder.take(None, step, (), now_ns, heard)
    assert not LogReader(path).lost
    return path


def _heard(t_ns: int, held: Any, writing: Writing) -> Heard:
    roll, pitch, yaw, heave = held.tolist()
    pulses = {f"servo{k}_raw": round(1500 + 500 * v) for k, v in enumerate((roll, -pitch, heave, -yaw), 1)}
    arrived_ns = t_ns + round(writing.late_ms * 1e6)
    fields = {"time_usec": (t_ns - BOOT_NS) // 1000, **pulses}
    received = ((LINK, Received("SERVO_OUTPUT_RAW", 1, 1, 0, fields, b"", arrived_ns)),) if writing.servos else ()
    state = SyncState(BOOT_NS, 0.0, 0.4, 0.2, 600, 0, 0)
    return Heard(received, ((LINK, state),) if writing.timesync else ())


def _ns(t_s: float) -> int:
    return round(1e9 * (t_s + 100.0))
