"""A marker waved through the room by hand, seen by simulated cameras whose clocks differ."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from tracker.camera import Camera
from tracker.maths import so3
from tracker.rig import Rig
from tracker.scene import Look
from tracker.sources.paths import PathFunction, Pose, ScriptedPath
from tracker.sources.sim import START_NS, SimSource, SimTiming
from tracker.types import Array, Event, Frame, frozen_array

AXES_inW = np.array([[1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, math.sqrt(2.0)]]) / math.sqrt(2.0)
REACH = np.array([0.55, 0.40, 0.35, 0.45, 0.45, math.pi])  # along AXES_inW [m], then roll, pitch, yaw [rad]


def waved(seed: int) -> PathFunction:
    """Return slow waves through most of what the paper's cameras see, with tilts that no flight has."""
    rng = np.random.default_rng((seed, 0xCA1))
    w = 2.0 * math.pi * np.array([0.13, 0.19, 0.23, 0.31, 0.29, 0.11]) * rng.uniform(0.8, 1.2, 6)
    phase = rng.uniform(0.0, 2.0 * math.pi, 6)

    def path(t_s: float) -> Pose:
        now = REACH * np.sin(w * t_s + phase)
        return now[:3] @ AXES_inW, so3.from_euler(*now[3:])

    return path


def footage_of(
    rig: Rig, seed: int, look: Look, duration_s: float, late_ns: Sequence[int]
) -> Iterator[Event]:  # fmt: skip
    """Yield the frames. late_ns: how much later than its stamps each camera sees [ns]."""
    timing = SimTiming(rate_hz=15.0, duration_s=duration_s)
    for event in SimSource(rig, ScriptedPath("waved", waved(seed), START_NS), lambda: 0, timing, look, seed):
        yield replace(event, t_ns=event.t_ns - late_ns[event.camera]) if isinstance(event, Frame) else event


def misplaced(camera: Camera, rng: np.random.Generator) -> Camera:
    """Return a camera that is said to stand 100 mm and 3 deg from where it does."""
    shift, turn = (x / np.linalg.norm(x) for x in rng.normal(size=(2, 3)))
    R: Array = camera.R_CtoW @ so3.exp(math.radians(3.0) * turn)
    return replace(camera, R_CtoW=frozen_array(R), p_CinW=frozen_array(camera.p_CinW + 0.1 * shift))
