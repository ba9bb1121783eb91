"""Rooms lit otherwise than the default one, and seen through other lenses and by cameras for screens."""

from __future__ import annotations

import pytest

from tools.bench.trial import Trial, fly
from tracker.scene import Look
from tracker.sources.sim import SimTiming

DIM = Look(
    (-0.46, -0.34, 0.62),
    0.41,
    0.74,
    0.13,
    blur_px=0.78,
    exposure_s=0.006,
    sub_exposures=13,
    read_noise=0.002,
    gamma=1.8,
)
BRIGHT = Look((-0.25, -0.38, 0.63), 0.52, 0.89, 0.13, blur_px=0.78, sub_exposures=9, gamma=1.8)
FROM_THE_SIDE = Look((0.9, 0.4, 0.5), 0.35, 0.85, 0.25, blur_px=0.4, exposure_s=0.002, full_well_e=1500.0)
SOFT = Look((0.1, 0.2, 1.0), 0.55, 0.55, 0.0, blur_px=0.6, full_well_e=8000.0, gamma=1.0)
ROOMS = {"dim": DIM, "bright": BRIGHT, "lit from the side": FROM_THE_SIDE, "lit softly": SOFT}


@pytest.mark.parametrize("look", ROOMS.values(), ids=ROOMS)
def test_the_light_is_learned_so_well_that_no_pose_is_wrong(look: Look) -> None:
    flown = fly(Trial("random-15", SimTiming(15.0, 3.4), look, seed=4))
    assert len(flown) > 48
    assert not flown.wrong()
    assert flown.position_mm.mean() < 0.3
