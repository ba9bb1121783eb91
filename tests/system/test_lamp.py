"""A lamp that is switched on in flight is noticed by the balls it falls on, and its light is learned at once."""

from __future__ import annotations

import numpy as np
import pytest

from tests.system.flights import RIG
from tools.bench.trial import Flown, Trial, fly, footage
from tracker.scene import Look
from tracker.sources.sim import START_NS, SimTiming
from tracker.types import Event

SWITCHED_S, LEARNED_S, DURATION_S = 7.5, 9.0, 11.0
FLIGHT = Trial("random-2", SimTiming(15.0, DURATION_S), seed=5)
ANOTHER_LAMP = Trial(
    FLIGHT.path, FLIGHT.timing, Look(lamp_inW=(-0.6, 0.4, 0.8), ambient=0.7, diffuse=1.2), seed=FLIGHT.seed
)


def switched(events: list[Event]) -> list[Event]:
    """Return what the cameras see when from SWITCHED_S on another lamp shines."""
    at_ns = START_NS + round(SWITCHED_S * 1e9)
    before = [event for event in events if event.t_ns < at_ns]
    return before + [event for event in footage(ANOTHER_LAMP, RIG, None) if event.t_ns >= at_ns]


@pytest.fixture(scope="module")
def flight() -> Flown:
    return fly(FLIGHT, spoil=switched)


def test_before_the_lamp_and_soon_after_it_no_pose_is_wrong(flight: Flown) -> None:
    assert flight.between(0.0, SWITCHED_S - 0.01).wrong() == {}
    assert flight.between(LEARNED_S, np.inf).wrong() == {}


def test_in_the_new_light_poses_err_hardly_more_than_in_the_old_one(flight: Flown) -> None:
    old, new = flight.between(1.0, SWITCHED_S - 0.01), flight.between(LEARNED_S, np.inf)
    assert new.position_mm.mean() < 0.05 + 1.5 * old.position_mm.mean()
    assert new.attitude_deg.mean() < 0.02 + 1.5 * old.attitude_deg.mean()
