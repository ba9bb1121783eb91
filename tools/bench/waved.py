"""A marker waved through the room by hand and set down, seen by simulated cameras whose clocks differ."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from tools.calibrate.room.footage import Footage, watch
from tracker.camera import Camera
from tracker.maths import so3
from tracker.rig import Rig, make_rig
from tracker.scene import Look
from tracker.sources.paths import ScriptedPath
from tracker.sources.sim import START_NS, SimSource, SimTiming
from tracker.sources.waving import waved_and_set_down
from tracker.types import Array, Event, Frame, frozen_array


def frames_of(rig: Rig, seed: int, look: Look, wave_s: float, late_ns: Sequence[int]) -> Iterator[Event]:
    """Yield the frames of waves and of three spots after them, 9.6 s. late_ns: how much later each camera sees [ns]."""
    timing = SimTiming(rate_hz=15.0, duration_s=wave_s + 9.6)
    path = ScriptedPath("waved", waved_and_set_down(seed, wave_s), START_NS)
    for event in SimSource(rig, path, lambda: 0, timing, look, seed):
        yield replace(event, t_ns=event.t_ns - late_ns[event.camera]) if isinstance(event, Frame) else event


def watched(true: Rig, seed: int, look: Look, wave_s: float, late_ns: Sequence[int]) -> tuple[Rig, Footage]:
    """Return a rig whose cameras are said to stand elsewhere, and the footage of the true one."""
    rng = np.random.default_rng(seed)
    said = make_rig(tuple(misplaced(camera, rng) for camera in true.cameras), true.marker)
    return said, watch(frames_of(true, seed, look, wave_s, late_ns), said, 100.0)


def misplaced(camera: Camera, rng: np.random.Generator) -> Camera:
    """Return a camera that is said to stand 100 mm and 3 deg from where it does."""
    shift, turn = (x / np.linalg.norm(x) for x in rng.normal(size=(2, 3)))
    R: Array = camera.R_CtoW @ so3.exp(math.radians(3.0) * turn)
    return replace(camera, R_CtoW=frozen_array(R), p_CinW=frozen_array(camera.p_CinW + 0.1 * shift))
