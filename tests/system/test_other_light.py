"""Rooms lit otherwise than the default one, and seen through other lenses and by cameras for screens."""

from __future__ import annotations

import pytest

from tools.bench.trial import Trial, fly
from tracker.scene import Lamp, Look
from tracker.scene.random_look import random_look
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
A_LAMP_NEAR = Look(ambient=0.2, diffuse=0.1, specular=0.01, lamps=(Lamp((0.5, -0.6, 0.9), 0.9),), gamma=1.0)
TWO_NEAR = Look(
    ambient=0.17,
    diffuse=0.05,
    specular=0.0,
    lamps=(Lamp((-1.0, 0.8, 0.9), 0.6), Lamp((0.8, 0.5, 1.2), 0.4)),
    gamma=1.0,
)
ROOMS = {"dim": DIM, "bright": BRIGHT, "lit from the side": FROM_THE_SIDE, "lit softly": SOFT}


@pytest.mark.parametrize("look", ROOMS.values(), ids=ROOMS)
def test_the_light_is_learned_so_well_that_no_pose_is_wrong(look: Look) -> None:
    flown = fly(Trial("random-15", SimTiming(15.0, 3.4), look, seed=4))
    assert len(flown) > 48
    assert not flown.wrong()
    assert flown.position_mm.mean() < 0.3


@pytest.mark.parametrize("look", [A_LAMP_NEAR, TWO_NEAR], ids=["a lamp near", "two near"])
def test_a_lamp_that_hangs_near_is_known_at_every_place(look: Look) -> None:
    flown = fly(Trial("random-12", SimTiming(15.0, 5.0), look, seed=4))
    assert not flown.wrong()
    assert flown.between(1.5, 5.0).position_mm.mean() < 0.2


def test_a_camera_whose_first_lessons_went_wrong_sees_again() -> None:
    """Here one camera takes smeared balls for another light, in which it would see none for the rest of the flight."""
    flown = fly(Trial("random-35", SimTiming(15.0, 2.4), random_look(35, 2.2), seed=35))
    assert not flown.wrong()
    assert flown.between(1.0, 2.4).position_mm.max() < 1.0
