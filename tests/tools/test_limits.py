"""The bounds of rendered images: as noise and geometry have them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bridge.settings import load_settings, rig_of
from tools.bench.limits import Key, centre_bounds, pose_bounds
from tools.bench.trial import Trial, footage
from tracker.rig import Rig
from tracker.scene import Look
from tracker.sources.groundtruth import GroundTruth
from tracker.sources.sim import SimTiming
from tracker.types import Array, Frame, frozen_array

RIG: Rig = rig_of(load_settings("lab"), None).rig
PAIRS = 10


@cache
def measured(full_well_e: float) -> tuple[dict[Key, Array], GroundTruth]:
    """Bound the images of a short flight through sensors whose pixels hold so many electrons."""
    look = Look(gamma=1.0, full_well_e=full_well_e, read_noise=0.0)
    trial = Trial("hover", SimTiming(15.0, PAIRS / 15.0), look, seed=3)
    frames = [event for event in footage(trial, RIG, None) if isinstance(event, Frame)]
    t_ns = np.array([frame.t_ns for frame in frames[::2]], dtype=np.int64)
    poses = [trial.vehicle().pose_at(int(t)) for t in t_ns]
    truth = GroundTruth(t_ns, frozen_array([p for p, _ in poses]), frozen_array([R for _, R in poses]))
    return centre_bounds(frames, RIG, truth), truth


def rms_px(full_well_e: float) -> float:
    bounds, _ = measured(full_well_e)
    return float(np.sqrt(np.mean([np.trace(bound) for bound in bounds.values()])))


def test_every_ball_image_has_a_bound_of_a_hundredth_of_a_pixel_or_so() -> None:
    bounds, _ = measured(3000.0)
    assert len(bounds) == PAIRS * 2 * 3
    assert 0.004 < rms_px(3000.0) < 0.04


def test_twice_the_noise_makes_twice_the_bound() -> None:
    assert rms_px(750.0) / rms_px(3000.0) == pytest.approx(2.0, rel=0.2)


def test_a_poses_bound_is_that_of_its_balls_by_their_distance() -> None:
    """A ball is known to b Z / f across each ray; the mean of three, to that over the root of three."""
    bounds, truth = measured(3000.0)
    poses = pose_bounds(bounds, RIG, truth)
    assert len(poses) == PAIRS
    found_m = np.sqrt(np.mean([np.trace(bound[:3, :3]) for bound in poses.values()]))
    camera = RIG.cameras[0]
    across_m = rms_px(3000.0) / np.sqrt(2.0) * float(np.linalg.norm(camera.p_CinW)) / camera.focal_px
    assert 0.5 < found_m / (across_m / np.sqrt(3.0) * np.sqrt(1.0 + 1.0 + 0.5)) < 2.0
