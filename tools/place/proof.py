"""Fly through the volume in front of rendered cameras, and hold the errors against the forecast."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tools.bench.trial import Trial, fly
from tools.place.limits import Limits
from tracker.camera import Camera
from tracker.maths import so3
from tracker.placement.forecast import forecast
from tracker.placement.views import Poses, look
from tracker.rig import make_rig
from tracker.scene import Look
from tracker.sources.paths import Pose, ScriptedPath
from tracker.sources.sim import START_NS, SimTiming
from tracker.types import Array

RATE_HZ, DURATION_S, SETTLED_S = 15.0, 16.0, 0.5
REACH = 0.8  # share of the volume's half widths
LEAN = 0.5  # share of the volume's lean
TURN_RAD_S = math.radians(25.0)


@dataclass(frozen=True, slots=True)
class Proof:
    """One flight: rms errors beside the rms of what was forecast for one instant's pictures at the same poses.

    wrong: how many of all its poses lay outside 5 sigma of the covariance that the tracker gave them.
    """

    estimates: int
    frames: int
    position_mm: float
    expected_position_mm: float
    attitude_deg: float
    expected_attitude_deg: float
    wrong: int

    @property
    def position_ratio(self) -> float:
        """Return flown by forecast: below 1 for a filter, which uses earlier pictures too."""
        return self.position_mm / self.expected_position_mm

    @property
    def attitude_ratio(self) -> float:
        """Return flown by forecast."""
        return self.attitude_deg / self.expected_attitude_deg


def prove(cameras: tuple[Camera, ...], limits: Limits, config: str, seed: int) -> Proof:
    """Fly once; the forecast counts at the poses that it calls covered, and so do the errors."""
    path = ScriptedPath("through the volume", lambda t_s: _pose(t_s, limits), START_NS)
    rig = make_rig(cameras, limits.marker)
    timing = SimTiming(RATE_HZ, DURATION_S)
    flown = fly(Trial(path, timing, Look(gamma=1.0), seed, config=config, rig=rig)).between(SETTLED_S, math.inf)
    frames = round((DURATION_S - SETTLED_S) * RATE_HZ)
    truth = [path.pose_at(int(t_ns)) for t_ns in flown.times_ns]
    if not truth:
        return Proof(0, frames, *(math.nan,) * 4, wrong=0)
    poses = Poses(np.stack([p for p, _ in truth]), np.stack([R for _, R in truth]), len(truth))
    views = [look(camera, limits.marker, poses, limits.sharpness) for camera in cameras]
    expected = forecast(views, limits.marker, poses)
    k = expected.covered
    return Proof(
        int(k.sum()),
        frames,
        _rms(flown.position_mm[k]),
        _rms(1e3 * expected.position_m[k]),
        _rms(flown.attitude_deg[k]),
        _rms(np.degrees(expected.attitude_rad[k])),
        len(flown.wrong()),
    )


def _pose(t_s: float, limits: Limits) -> Pose:
    """Wind through the volume at well under a metre a second, turning and leaning meanwhile."""
    half = REACH * (limits.volume.high - limits.volume.low) / 2.0
    swing = np.array([math.sin(0.55 * t_s), math.sin(0.83 * t_s + 1.0), math.sin(0.71 * t_s + 2.0)])
    lean = LEAN * limits.tilt_rad
    R = so3.from_euler(lean * math.sin(0.9 * t_s), lean * math.sin(1.1 * t_s + 0.5), TURN_RAD_S * t_s)
    return limits.volume.centre + half * swing, R


def _rms(values: Array) -> float:
    return float(np.sqrt((values**2).mean())) if len(values) else math.nan
