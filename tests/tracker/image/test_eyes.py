"""A camera that takes the light for another sees again; one whose view is covered keeps the light it knows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.tracker.drawing import frame
from tests.tracker.paper_rig import paper_rig
from tests.tracker.rigs import state
from tracker.image.eyes import Eyes
from tracker.image.tint import NEUTRAL, Gains
from tracker.types import Frame

RIG = paper_rig()
FLYING = state(0, (0.2, -0.1, 0.1), (12.0, -8.0, 130.0))
SEEN = [frame(FLYING, RIG, camera, 0) for camera in range(2)]
WRONG = Gains(blue=1.7, red=1.8)  # no ball keeps its colour in it


def counts(eyes: Eyes, frames: list[Frame]) -> list[int]:
    """Return how many balls each camera shows."""
    cameras = [sighting.camera for sighting in eyes.look(frames, FLYING).sightings]
    return [cameras.count(camera) for camera in range(2)]


def mistaken() -> Eyes:
    """Return eyes of which camera 1 saw all balls and then took the light for another."""
    eyes = Eyes(RIG)
    assert counts(eyes, SEEN) == [3, 3]
    eyes.suppose((NEUTRAL, WRONG))
    return eyes


def test_a_camera_that_mistook_the_light_goes_back_to_the_one_that_showed_all_balls() -> None:
    eyes = mistaken()
    assert counts(eyes, SEEN) == [3, 3]
    assert eyes.gains[1] == NEUTRAL


def test_fewer_balls_than_all_do_not_bring_a_light_back() -> None:
    eyes = mistaken()
    assert counts(eyes, [SEEN[0], frame(FLYING, RIG, 1, 0, hidden=(2,))]) == [3, 0]
    assert eyes.gains[1] == WRONG


def test_a_covered_camera_keeps_the_light_it_knows() -> None:
    eyes = Eyes(RIG)
    counts(eyes, SEEN)
    known = NEUTRAL, Gains(blue=1.3, red=1.0)
    eyes.suppose(known)
    covered = replace(SEEN[1], image=np.full_like(SEEN[1].image, 60))
    assert [counts(eyes, [SEEN[0], covered]) for _ in range(3)] == [[3, 0]] * 3
    assert eyes.gains == known
    assert counts(eyes, SEEN) == [3, 3]
