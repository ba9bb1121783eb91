"""Flights before walls with writing, books and windows: the room behind the balls is learned, and moves no pose."""

from __future__ import annotations

import pytest

from tools.bench.trial import Trial, fly
from tracker.scene import Look
from tracker.sources.sim import SimTiming

KNOWN_S = 8.0  # by then the room is, and gamma is told by it
SEEDS = (2, 3)  # of rooms, each with things behind a corner of the square


@pytest.mark.parametrize("seed", SEEDS)
def test_a_vehicle_that_stands_before_things_is_seen_as_well_as_before_a_plain_wall(seed: int) -> None:
    flown = fly(Trial("square", SimTiming(15.0, 14.0), Look(), seed=seed))
    late = flown.between(KNOWN_S, 99.0)
    assert len(late) > 85
    assert late.position_mm.mean() < 0.18
    assert late.nees(slice(0, 6)).mean() / 6.0 < 1.3
    assert not late.wrong()
