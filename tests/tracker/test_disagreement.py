"""Cameras of which one no longer hangs where it was calibrated: what they disagree on is not explained by a speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.drawing import frame
from tests.tracker.rigs import ring_rig, state
from tests.tracker.test_pipeline import PERIOD_NS, START_NS, estimates, flown, tracker
from tracker.rig import Rig
from tracker.types import Event

RIG = ring_rig(2)
STILL = state(START_NS, (0.01, 0.02, 0.0), (1.0, -2.0, 5.0))


def knocked(off_mm: float) -> Rig:
    """Return the rig with camera 1 said to hang aside: across the plane of both cameras and the marker."""
    first, second = RIG.cameras
    across = np.cross(first.p_CinW, second.p_CinW)
    moved_m = off_mm * 1e-3 * across / np.linalg.norm(across)
    return replace(RIG, cameras=(first, replace(second, p_CinW=second.p_CinW + moved_m)))


def flight(apart_ns: int) -> list[Event]:
    """Return six pairs, their stamps so far apart."""
    views = [(k, c, START_NS + k * PERIOD_NS + c * apart_ns) for k in range(6) for c in (0, 1)]
    return [frame(STILL, RIG, c, t_ns, noise=(1.5, np.random.default_rng((k, c)))) for k, c, t_ns in views]


@pytest.mark.parametrize("apart_ns", [0, 3000])
@pytest.mark.parametrize("off_mm", [-5.0, -3.0, 3.0, 5.0, 8.0])
def test_a_vehicle_that_stands_still_is_not_said_to_move(off_mm: float, apart_ns: int) -> None:
    """A speed times a clock's offset, both unknown, would make the rays meet: 13 m/s times 0.3 ms."""
    speeds = [np.linalg.norm(one.v_BinW) for one in estimates(flown(tracker(knocked(off_mm)), flight(apart_ns)))]
    assert max(speeds, default=0.0) < 0.5


def test_cameras_that_disagree_by_much_start_no_track_and_say_so() -> None:
    steps = flown(tracker(knocked(8.0)), flight(0))
    assert estimates(steps) == []
    assert any("do not agree" in one.detail and "moved" in one.detail for step in steps for one in step.rejections)
