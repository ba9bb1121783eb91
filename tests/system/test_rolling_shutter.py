"""Cameras that read their pictures out row by row, as most webcams do."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.system.flights import LINEAR, RIG
from tools.bench.trial import Flown, Trial, footage, tracked
from tracker.rig import Rig, make_rig
from tracker.sources.sim import SimTiming

READOUT_NS = 20_000_000
TIMING = SimTiming(15.0, 2.4)
FRAMES = 36


def rolling(first_ns: int, second_ns: int) -> Rig:
    """Return the lab's rig with cameras that take so long from the first row to the last."""
    first, second = RIG.cameras
    return make_rig((replace(first, readout_ns=first_ns), replace(second, readout_ns=second_ns)), RIG.marker)


@cache
def flown(told_ns: tuple[int, int], true_ns: tuple[int, int] = (READOUT_NS, -READOUT_NS)) -> Flown:
    """Fly before cameras that roll, tracked by what is told of them."""
    trial = Trial("random-3", TIMING, LINEAR, seed=3)
    return tracked(trial, rolling(*told_ns), footage(trial, rolling(*true_ns), None))


def test_a_known_shutter_costs_no_accuracy_and_no_pose() -> None:
    rolled, still = flown((READOUT_NS, -READOUT_NS)).between(0.5, np.inf), flown((0, 0), (0, 0)).between(0.5, np.inf)
    assert len(flown((READOUT_NS, -READOUT_NS))) == FRAMES
    assert flown((READOUT_NS, -READOUT_NS)).wrong() == {}
    assert rolled.position_mm.mean() < 1.3 * still.position_mm.mean()
    assert rolled.attitude_deg.mean() < 1.3 * still.attitude_deg.mean()


def test_a_shutter_nobody_told_of_does() -> None:
    """Else the test above proves nothing."""
    untold, told = flown((0, 0)), flown((READOUT_NS, -READOUT_NS))
    assert untold.position_mm.mean() > 3.0 * told.position_mm.mean()


@pytest.mark.parametrize(("row", "late_ns"), [(0, -10_000_000), (479, 10_000_000), (239.5, 0)])
def test_a_row_is_as_late_as_it_is_far_from_the_middle(row: float, late_ns: int) -> None:
    first, second = rolling(READOUT_NS, -READOUT_NS).cameras
    assert first.delay_ns(row) == pytest.approx(late_ns)
    assert second.delay_ns(row) == pytest.approx(-late_ns)
