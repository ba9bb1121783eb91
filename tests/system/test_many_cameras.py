"""Two to eight cameras in a ring round the room, through the same code."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.system.flights import LINEAR, RIG, by_seconds, during
from tools.bench.ring import ring_rig
from tools.bench.trial import Flown, Trial, fly
from tracker.scene import Trouble
from tracker.sources.sim import SimTiming

DURATION_S, FRAMES = 2.4, 36
COUNTS = (2, 3, 4, 8)


@cache
def flown(cameras: int, blind: int | None = None, free: bool = False) -> Flown:
    """Fly with so many cameras; one is blind after a second, or all run free."""
    offsets_ns = tuple(round(k * 1e9 / 15.0 / cameras) for k in range(cameras)) if free else ()
    timing = SimTiming(15.0, DURATION_S, offsets_ns=offsets_ns)
    fault = None if blind is None else by_seconds(during(Trouble(light_gain=0.0), [blind], first_s=1.0, last_s=9.0))
    return fly(Trial("random-6", timing, LINEAR, seed=6, rig=ring_rig(RIG.marker, cameras, view_deg=36.0)), fault)


@pytest.mark.parametrize("cameras", COUNTS)
def test_every_instant_gives_a_pose_and_none_is_wrong(cameras: int) -> None:
    run = flown(cameras)
    assert len(run) == FRAMES
    assert run.wrong() == {}
    assert run.nis_dof[-1] == 6 * cameras


@pytest.mark.parametrize("cameras", COUNTS)
def test_more_cameras_are_no_worse_than_two(cameras: int) -> None:
    two, more = (flown(count).between(1.0, np.inf) for count in (2, cameras))
    assert more.position_mm.mean() <= 1.1 * two.position_mm.mean()
    assert more.attitude_deg.mean() <= 1.1 * two.attitude_deg.mean()


@pytest.mark.parametrize("blind", [0, 1, 2])
def test_one_blind_camera_of_three_costs_no_pose(blind: int) -> None:
    run = flown(3, blind)
    assert len(run) == FRAMES
    assert run.wrong() == {}
    assert (run.between(1.05, np.inf).nis_dof == 12).all()


@pytest.mark.parametrize("cameras", [3, 4])
def test_cameras_that_run_free_each_give_a_pose_of_their_own_time(cameras: int) -> None:
    run = flown(cameras, free=True)
    assert len(run) >= cameras * (FRAMES - 2)
    assert run.wrong() == {}
