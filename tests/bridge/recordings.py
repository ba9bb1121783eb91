"""Steps to record, and recorders to record them, for the log's tests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from bridge.recorder import Recorder
from bridge.wire import FieldValue, Sent
from tests.bridge.estimates import random_covariance
from tracker.camera import Camera, make_camera
from tracker.maths import so3
from tracker.rig import Ball, Colour, Marker, make_marker
from tracker.types import BallSighting, Estimate, Event, Frame, Reason, Rejected, Step, TrackState, frozen_array

PERIOD_NS = 33_333_333
START_NS = 1_700_000_000_000_000_000
WALL_NS = 1_800_000_000_000_000_000
LINK = "udpout:127.0.0.1:14550"
CONFIG = b"[vehicle]\nsystem_id = 1\n"

Turn = tuple[Event, Step, tuple[Sent, ...], int]


def cameras() -> tuple[Camera, ...]:
    """Return two cameras a metre apart, with distortions of four and of eight coefficients."""
    right = np.eye(4)
    right[0, 3] = 1.0
    return (
        make_camera("cam0", (752, 480), (450.0, 451.0, 376.0, 240.0), (0.1, 0.0, 0.0, 0.0), np.eye(4)),
        make_camera("cam1", (752, 480), (450.0, 451.0, 376.0, 240.0), (0.1,) * 8, right),
    )


def marker() -> Marker:
    """Return three red balls in a right angle."""
    red = Colour(0.0, 10.0, 0.5, 0.5, (0, 0, 255))
    corners = ((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0))
    return make_marker(tuple(Ball(f"ball{i}", frozen_array(p), 0.02, red) for i, p in enumerate(corners)))


def recorder(path: Path, **options: Any) -> Recorder:
    """Return a recorder of that room; nothing is dropped unless the options say so."""
    chosen: dict[str, Any] = {"block_when_full": True, "wall_clock": lambda: WALL_NS, **options}
    return Recorder(
        path,
        attachments={"config.toml": CONFIG},
        metadata={"run": {"source": "recording:somewhere"}, "versions": {"posebridge": "0.1.0"}},
        cameras=cameras(),
        marker=marker(),
        **chosen,
    )


def turn(k: int, generator: np.random.Generator) -> Turn:
    """Return the k-th turn of a loop at 30 Hz: one frame, its sightings, one random estimate, one message."""
    t_ns = START_NS + k * PERIOD_NS
    sightings = tuple(
        BallSighting(0, ball, t_ns, frozen_array(generator.uniform(0, 480, 2)), frozen_array([[0.2, 0.1], [0.1, 0.3]]))
        for ball in range(3)
    )
    estimate = Estimate(
        t_ns=t_ns,
        p_BinW=frozen_array(generator.normal(size=3)),
        R_BtoW=frozen_array(so3.exp(generator.normal(size=3))),
        v_BinW=frozen_array(generator.normal(size=3)),
        w_BinB=frozen_array(generator.normal(size=3)),
        covariance=frozen_array(random_covariance(generator, 12)),
        state=TrackState.TRACKING,
        reset_counter=k // 100,
        nis=float(generator.chisquare(6)),
        nis_dof=6,
        available_ns=1_000 + k,
        stages_ns=MappingProxyType({"detect": 400_000, "ekf": 90_000}),
        clock_offsets_s=frozen_array((0.0, 0.25)),
        clock_sigmas_s=frozen_array((0.0, 0.5)),
    )
    rejected = Rejected(Reason.NO_BALL, "ball 1 is hidden", t_ns, 0)
    fields: dict[str, FieldValue] = {"usec": t_ns // 1000, "x": 0.5, "covariance": [math.nan, 0.25]}
    sent = Sent(LINK, "VISION_POSITION_ESTIMATE", t_ns, 5_001_000 + k, 1_000 + k, b"\xfd\x01\x02", fields)
    frame = Frame(0, t_ns, np.zeros((2, 2, 3), np.uint8), 1_000 + k)
    return frame, Step(TrackState.TRACKING, sightings, (rejected,), (estimate,)), (sent,), t_ns + 20_000_000


def turns(count: int, seed: int = 1) -> list[Turn]:
    """Return the first turns of a flight."""
    generator = np.random.default_rng(seed)
    return [turn(k, generator) for k in range(count)]


def record(path: Path, flight: Sequence[Turn], **options: Any) -> None:
    """Write a flight to a log."""
    with recorder(path, **options) as log:
        for one in flight:
            log.take(*one)
