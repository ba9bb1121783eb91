"""Which points are the marker: its own shape tells, among whatever else has its colours."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tracker.paper_rig import paper_rig
from tracker.maths import so3
from tracker.start.associate import associate
from tracker.types import Array, Point, Reason, Rejected, frozen_array

MARKER = paper_rig().marker
SIGMA_M = 0.002
PLACED = MARKER.points_inB @ so3.from_euler(0.2, -0.1, 2.0).T + np.array([0.3, -0.2, 0.1])


def point(p_inW: Array, sigma_m: float = SIGMA_M) -> Point:
    return Point(frozen_array(p_inW), frozen_array(sigma_m**2 * np.eye(3)), 0.0)


def chosen(found: tuple[Point, ...] | Rejected) -> Array:
    assert not isinstance(found, Rejected), found
    return np.stack([p.p_inW for p in found])


def test_the_three_points_that_are_the_marker_are_chosen_in_the_balls_order() -> None:
    assert np.array_equal(chosen(associate([[point(p)] for p in PLACED], MARKER, 0.0)), PLACED)


@pytest.mark.parametrize("seed", range(5))
def test_decoys_of_the_same_colours_are_passed_over_wherever_they_stand_in_the_lists(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lists = []
    for p in PLACED:
        places = [point(p + rng.normal(scale=0.5 * SIGMA_M, size=3))]
        places += [point(decoy) for decoy in rng.uniform(-1.0, 1.0, size=(6, 3))]
        lists.append([places[i] for i in rng.permutation(len(places))])
    assert np.allclose(chosen(associate(lists, MARKER, 0.0)), PLACED, atol=4.0 * SIGMA_M)


def test_of_two_choices_that_would_do_the_better_one_is_taken() -> None:
    nearly = PLACED[2] + 2.0 * SIGMA_M
    found = associate([[point(PLACED[0])], [point(PLACED[1])], [point(nearly), point(PLACED[2])]], MARKER, 0.0)
    assert np.array_equal(chosen(found), PLACED)


def test_a_ball_with_no_place_at_all_is_named() -> None:
    found = associate([[point(PLACED[0])], [], [point(PLACED[2])]], MARKER, 0.0)
    assert isinstance(found, Rejected)
    assert found.reason is Reason.NOT_FOUND
    assert "green" in found.detail


def test_points_that_are_not_the_marker_are_rejected() -> None:
    """Each side may be off by four sigma of both its ends: 4 sqrt(2) 2 mm are 11.3 mm."""
    along = (PLACED[1] - PLACED[0]) / 0.16
    across = np.cross(along, np.cross(PLACED[2] - PLACED[0], along))
    across /= np.linalg.norm(across)
    for shift_m, good in ((0.010, True), (0.014, False)):
        moved = [point(PLACED[0]), point(PLACED[1] + shift_m * along), point(PLACED[2] + 0.5 * shift_m * along)]
        found = associate([[p] for p in moved], MARKER, 0.0)
        assert isinstance(found, Rejected) is not good
        if isinstance(found, Rejected):
            assert found.reason is Reason.GEOMETRY


def test_cameras_that_did_not_see_one_instant_are_given_slack() -> None:
    stretched = [point(p) for p in PLACED * 1.15]
    assert isinstance(associate([[p] for p in stretched], MARKER, 0.0), Rejected)
    assert not isinstance(associate([[p] for p in stretched], MARKER, 0.02), Rejected)


def test_two_balls_in_one_place_are_not_the_marker() -> None:
    found = associate([[point(PLACED[0])], [point(PLACED[0])], [point(PLACED[2])]], MARKER, 0.0)
    assert isinstance(found, Rejected)
    assert found.reason is Reason.GEOMETRY


def test_a_room_full_of_the_balls_colours_is_searched_no_longer_than_a_limit() -> None:
    rng = np.random.default_rng(1)
    crowd = [[point(p) for p in rng.uniform(-1.0, 1.0, size=(40, 3))] for _ in range(3)]
    for places, p in zip(crowd, PLACED, strict=True):
        places.insert(3, point(p))
    assert len(crowd[0]) ** 3 > 20_000
    found = chosen(associate(crowd, MARKER, 0.0))
    sides = np.linalg.norm(found - np.roll(found, 1, axis=0), axis=1)
    assert np.allclose(sides, 0.16, atol=0.012)
