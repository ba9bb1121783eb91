"""Three sightings fit some pose whatever they show, so their shape tells no liar: nobody is picked out among so few."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from tests.tracker.rigs import PROCESS, ring_rig, sightings, state
from tracker.filter.ekf import Update, update
from tracker.filter.predict import predict
from tracker.types import Reason, Rejected, frozen_array

RIG = ring_rig(2)
LATER_NS = 66_666_667
FLYING = state(0, (0.2, -0.1, 0.1), (12.0, -8.0, 130.0), (0.5, -0.3, 0.2), (0.4, -0.8, 1.0))
SLIGHTLY, FAR = (6.4, -4.8), (90.0, -60.0)  # px: as a manoeuvre may move a ball, and beyond any

Shifts = Mapping[int, tuple[float, float]]


def found(cameras: tuple[int, ...], shifts_px: Shifts, count: int | None = None) -> Update | Rejected:
    """Update a track by what cameras see, or the first of it, some of the sightings moved."""
    views = [(camera, LATER_NS) for camera in cameras]
    seen = list(sightings(FLYING, RIG, views, 0.1, np.random.default_rng(1)))
    for index, shift_px in shifts_px.items():
        seen[index] = seen[index]._replace(uv_px=frozen_array(seen[index].uv_px + shift_px))
    return update(predict(FLYING, LATER_NS, PROCESS), tuple(seen[:count]), RIG, 0.999)


def used(one: Update | Rejected) -> list[tuple[int, int]]:
    assert isinstance(one, Update), one
    return [(sighting.camera, sighting.ball) for sighting in one.used]


@pytest.mark.parametrize("ball", range(3))
def test_a_camera_alone_is_believed_whole_or_not_at_all(ball: int) -> None:
    assert used(found((1,), {})) == [(1, 0), (1, 1), (1, 2)]
    one = found((1,), {ball: SLIGHTLY})
    assert isinstance(one, Rejected)
    assert one.reason is Reason.FRAME_GATE


@pytest.mark.parametrize("ball", range(3))
def test_two_cameras_tell_the_same_liar_by_the_markers_shape(ball: int) -> None:
    assert set(used(found((0, 1), {ball: SLIGHTLY}))) == {(c, b) for c in (0, 1) for b in range(3)} - {(0, ball)}


@pytest.mark.parametrize("ball", range(3))
def test_a_ball_no_manoeuvre_explains_is_left_out_where_the_rest_is_as_expected(ball: int) -> None:
    assert used(found((1,), {ball: FAR})) == [(1, other) for other in range(3) if other != ball]


@pytest.mark.parametrize("ball", range(3))
def test_one_ball_does_not_carry_the_track_where_the_others_are_elsewhere(ball: int) -> None:
    elsewhere: Shifts = {other: FAR for other in range(3) if other != ball}
    assert isinstance(found((1,), elsewhere), Rejected)
    assert set(used(found((0, 1), elsewhere))) == {(0, ball), (1, 0), (1, 1), (1, 2)}


@pytest.mark.parametrize("liar", range(2))
def test_of_two_sightings_alone_that_contradict_each_other_neither_is_believed(liar: int) -> None:
    """The track is in doubt where one of them is not where it said, and the other may be there by chance."""
    assert used(found((0,), {}, count=2)) == [(0, 0), (0, 1)]
    one = found((0,), {liar: FAR}, count=2)
    assert isinstance(one, Rejected)
    assert one.reason is Reason.FRAME_GATE
