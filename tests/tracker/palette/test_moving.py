"""Colours seen by what moves, before anybody knows where the cameras stand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.palette.rooms import RIG, SIDE_LIGHT, Casts, Thing, cast, flown
from tests.tracker.rigs import TUNING
from tools.calibrate.room.balls import find_balls
from tracker.errors import OperatorError
from tracker.palette.learn import Instant, NoMarkerError, learn, with_colours
from tracker.palette.moving import FirstLook, look_first
from tracker.rig import Rig, make_rig
from tracker.scene import Look
from tracker.sources.paths import scripted_path

ELSEWHERE = make_rig(tuple(replace(camera, R_CtoW=np.eye(3)) for camera in RIG.cameras), RIG.marker)
LOOK_ALIKES: tuple[Thing, ...] = (
    (0, (60, 60, 68, 68), (17, 91, 205)),
    (0, (80, 60, 88, 68), (50, 157, 33)),
    (0, (70, 76, 78, 84), (24, 186, 198)),
)


def right(look: FirstLook, instants: Sequence[Instant]) -> float:
    """Return the share of pictures in which every ball was found where it is, by the cameras' true places."""
    vehicle = scripted_path("figure8", 0)
    count = 0
    for camera, pictures in zip(RIG.cameras, look.balls, strict=True):
        for instant, balls in zip(instants, pictures, strict=True):
            p_BinW, R_BtoW = vehicle.pose_at(instant[0].t_ns)[:2]
            true_px, _ = camera.project(RIG.marker.points_inB @ R_BtoW.T + p_BinW)
            count += bool(balls) and bool(np.abs(np.stack([ball.uv_px for ball in balls]) - true_px).max() < 1.5)
    return count / (len(RIG.cameras) * len(instants))


def seen_by_calibration(instants: Sequence[Instant], rig: Rig) -> float:
    """Return the share of pictures in which the calibration of a room, which has colours alone, finds the balls."""
    frames = [frame for instant in instants for frame in instant]
    return sum(find_balls(frame, rig) is not None for frame in frames) / len(frames)


@pytest.mark.parametrize("look", [None, SIDE_LIGHT, Look(jpeg_quality=85)])
@pytest.mark.parametrize("casts", [{}, {0: (1.2, 0.8, 1.2)}, {0: (1.2, 1.0, 0.8), 1: (1.2, 1.0, 0.8)}])
def test_wherever_the_cameras_are_said_to_stand_the_colours_do_for_calibrating_the_room(
    look: Look | None, casts: Casts
) -> None:
    instants = cast(flown(look=look), casts)
    with pytest.raises(NoMarkerError):
        learn(instants, ELSEWHERE, TUNING)
    found = look_first(instants, ELSEWHERE)
    assert right(found, instants) >= 0.9
    in_a_known_room = learn(instants, RIG, TUNING).rig
    first = seen_by_calibration(instants, with_colours(RIG, found.colours))
    assert first >= 0.9 * seen_by_calibration(instants, in_a_known_room) > 0.0


def test_with_the_configured_colours_no_room_could_be_calibrated_under_a_cast() -> None:
    """Else the test above shows nothing."""
    warm = cast(flown(look=Look(jpeg_quality=85)), {0: (1.2, 1.0, 0.8), 1: (1.2, 1.0, 0.8)})
    assert seen_by_calibration(warm, RIG) < 0.1


def test_what_stays_where_it_is_is_no_ball_however_alike() -> None:
    instants = flown(LOOK_ALIKES)
    assert right(look_first(instants, ELSEWHERE), instants) >= 0.8


@pytest.mark.parametrize("instants", [flown(count=1) * 12, flown(count=3)])
def test_a_vehicle_that_stands_or_was_hardly_shown_teaches_nothing(instants: tuple[Instant, ...]) -> None:
    with pytest.raises(OperatorError, match="nothing like 3 balls moves before cam0"):
        look_first(instants, ELSEWHERE)
