"""Cameras that the balls are too bright for are told, by pictures drawn apart from the product's renderer."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.tracker.drawing import frame
from tests.tracker.paper_rig import paper_rig
from tests.tracker.rigs import sightings, state
from tracker.exposed import NEWEST, Exposed
from tracker.standing import CameraHealth, Health, Witness
from tracker.types import Frame

RIG = paper_rig()
TRUTH = state()
SEEN = sightings(TRUTH, RIG, [(0, TRUTH.t_ns), (1, TRUTH.t_ns)], 0.1)
PLAIN = [frame(TRUTH, RIG, camera, TRUTH.t_ns) for camera in range(len(RIG.cameras))]


def brighter(one: Frame) -> Frame:
    return replace(one, image=cv2.convertScaleAbs(one.image, alpha=4.0).astype(np.uint8))


def test_balls_as_they_should_be_fill_nothing() -> None:
    exposed = Exposed(RIG)
    exposed.look(PLAIN, SEEN, TRUTH)
    assert exposed.shares == [0.0, 0.0]


def test_the_camera_that_is_too_bright_is_the_one_told() -> None:
    exposed = Exposed(RIG)
    exposed.look([PLAIN[0], brighter(PLAIN[1])], SEEN, TRUTH)
    assert exposed.shares[0] == 0.0
    assert 0.5 < exposed.shares[1] <= 1.0


def test_what_is_told_follows_the_light_and_stays_where_no_ball_is_seen() -> None:
    exposed = Exposed(RIG)
    exposed.look([brighter(one) for one in PLAIN], SEEN, TRUTH)
    bright = list(exposed.shares)
    exposed.look(PLAIN, SEEN, TRUTH)
    assert exposed.shares == pytest.approx([(1.0 - NEWEST) * share for share in bright])
    exposed.look(PLAIN, (), TRUTH)
    assert exposed.shares == pytest.approx([(1.0 - NEWEST) * share for share in bright])


def test_it_is_told_with_how_the_cameras_stand() -> None:
    exposed = Exposed(RIG)
    exposed.look([PLAIN[0], brighter(PLAIN[1])], SEEN, TRUTH)
    told = exposed.told(Health(0, tuple(CameraHealth(one.name, False, Witness.STILL) for one in RIG.cameras)))
    assert [camera.full_share for camera in told.cameras] == exposed.shares
