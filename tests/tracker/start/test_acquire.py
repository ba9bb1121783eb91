"""A first state from blobs alone, in the clutter of a room."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.rigs import PROCESS, SECOND_NS, at, difference, ring_rig, seen_px, state
from tracker.image.detect import Blob
from tracker.maths import so3
from tracker.rig import Rig
from tracker.start.acquire import Seen, first_state
from tracker.state import State
from tracker.types import Frame, Reason, Rejected, frozen_array

IMAGE = np.zeros((2, 2, 3), np.uint8)
TRUTH = state(SECOND_NS, (0.2, -0.1, 0.1), (12.0, -8.0, 130.0))


def seen(
    truth: State, rig: Rig, times_ns: dict[int, int], sigma_px: float = 0.0, decoys: int = 0, seed: int = 1
) -> Seen:
    """Return the blobs of each camera: the balls', and decoys of their colours anywhere in the image."""
    rng = np.random.default_rng(seed)
    found = {}
    for camera, t_ns in times_ns.items():
        blobs = []
        for uv_px in seen_px(truth, rig, camera, t_ns):
            places = [uv_px + rng.normal(scale=sigma_px, size=2), *rng.uniform((0, 0), (640, 480), size=(decoys, 2))]
            blobs.append([Blob(frozen_array(places[i]), 25.0) for i in rng.permutation(len(places))])
        found[camera] = (Frame(camera, t_ns, IMAGE), blobs)
    return found


def started(found: State | Rejected) -> State:
    assert isinstance(found, State), found
    return found


@pytest.mark.parametrize("camera_count", [2, 3, 4])
def test_the_marker_is_found_where_it_is(camera_count: int) -> None:
    rig = ring_rig(camera_count)
    found = started(first_state(seen(TRUTH, rig, dict.fromkeys(range(camera_count), SECOND_NS)), rig, PROCESS))
    error = difference(TRUTH, found)
    assert found.t_ns == SECOND_NS
    assert np.abs(error[:3]).max() < 1e-6
    assert np.abs(error[3:6]).max() < 1e-5
    assert not found.v_BinW.any()


@pytest.mark.parametrize("seed", range(4))
def test_it_is_found_among_decoys_of_its_colours_from_rough_centroids(seed: int) -> None:
    rig = ring_rig(2)
    found = started(first_state(seen(TRUTH, rig, {0: SECOND_NS, 1: SECOND_NS}, 0.5, 5, seed), rig, PROCESS))
    error = difference(TRUTH, found)
    assert np.abs(error[:3]).max() < 0.005
    assert np.abs(error[3:6]).max() < 0.1


def in_a_room_of_orange(truth: State, rig: Rig, times_ns: dict[int, int], count: int, seed: int) -> Seen:
    """Return what is seen where many things have one ball's colour, most of them larger than the ball."""
    rng, whole = np.random.default_rng(seed), dict(seen(truth, rig, times_ns, 0.5, 0, seed))
    for camera, (frame, blobs) in whole.items():
        places, areas = rng.uniform((0, 0), (640, 480), size=(count, 2)), rng.uniform(5.0, 400.0, size=count)
        things = [Blob(frozen_array(uv_px), float(area)) for uv_px, area in zip(places, areas, strict=True)]
        every = sorted((*blobs[2], *things), key=lambda blob: -blob.area_px)
        whole[camera] = (frame, [blobs[0], blobs[1], every])
    return whole


@pytest.mark.parametrize("seed", range(4))
def test_it_is_found_where_a_hundred_larger_things_have_a_balls_colour(seed: int) -> None:
    """Wood, boxes and bricks are orange: the largest spots of a colour need not hold the ball's."""
    rig = ring_rig(2)
    whole = in_a_room_of_orange(TRUTH, rig, {0: SECOND_NS, 1: SECOND_NS}, 100, seed)
    error = difference(TRUTH, started(first_state(whole, rig, PROCESS)))
    assert np.abs(error[:3]).max() < 0.005
    assert np.abs(error[3:6]).max() < 0.1


def test_a_thing_that_looks_too_large_for_a_ball_where_it_is_is_none() -> None:
    """The same spots of the balls' colours, 25 times as large, would be balls five times nearer."""
    rig = ring_rig(2)
    whole = {
        camera: (frame, [[Blob(blob.uv_px, 25.0 * blob.area_px) for blob in each] for each in blobs])
        for camera, (frame, blobs) in seen(TRUTH, rig, {0: SECOND_NS, 1: SECOND_NS}).items()
    }
    found = first_state(whole, rig, PROCESS)
    assert isinstance(found, Rejected)
    assert found.reason is Reason.NOT_FOUND


def test_one_trigger_tells_the_marker_from_what_only_motion_would_explain() -> None:
    """A false orange ball, turned by 60 deg about the other two, has the marker's sides; its rays miss by 30 mm."""
    rig = ring_rig(2)
    whole = dict(seen(TRUTH, rig, {0: SECOND_NS, 1: SECOND_NS}, 0.5))
    p1, p2, p3 = rig.marker.points_inB
    turn = so3.exp(np.pi / 3.0 * (p2 - p1) / np.linalg.norm(p2 - p1))
    false = TRUTH.p_BinW + TRUTH.R_BtoW @ (p1 + turn @ (p3 - p1))
    across = np.cross(rig.cameras[1].p_CinW - rig.cameras[0].p_CinW, false - rig.cameras[0].p_CinW)
    across *= 0.015 / np.linalg.norm(across)
    for (camera, (frame, blobs)), shift_m in zip(whole.items(), (across, -across), strict=True):
        spot = Blob(frozen_array(rig.cameras[camera].project((false + shift_m)[None])[0][0]), 25.0)
        whole[camera] = (frame, [blobs[0], blobs[1], [spot, *blobs[2]]])
    assert np.abs(difference(TRUTH, started(first_state(whole, rig, PROCESS)))[3:6]).max() < 0.1


def test_a_spot_grown_together_with_another_still_starts_a_track() -> None:
    """Its middle is 6 px off in one camera: 16 mm, more than one trigger explains."""
    rig = ring_rig(2)
    whole = dict(seen(TRUTH, rig, {0: SECOND_NS, 1: SECOND_NS}))
    frame, blobs = whole[1]
    grown = Blob(frozen_array(blobs[2][0].uv_px + np.array([6.0, 0.0])), 60.0)
    whole[1] = (frame, [blobs[0], blobs[1], [grown]])
    error = difference(TRUTH, started(first_state(whole, rig, PROCESS)))
    assert np.abs(error[:3]).max() < 0.02


def test_its_covariance_covers_what_the_first_look_may_err_by() -> None:
    """And velocity and rate, of which nothing is known yet."""
    rig = ring_rig(2)
    fast = state(SECOND_NS, (0.2, -0.1, 0.1), (12.0, -8.0, 130.0), (1.0, 1.0, -2.5), (1.5, 0.0, 1.5))
    found = started(first_state(seen(fast, rig, {0: SECOND_NS, 1: SECOND_NS}, 0.5), rig, PROCESS))
    error = difference(fast, found)
    assert error @ np.linalg.solve(found.P[:12, :12], error) < 12.0
    assert np.linalg.eigvalsh(found.P).min() > 0.0


@pytest.mark.parametrize("speed_m_s", [0.0, 1.5])
def test_free_running_cameras_half_a_frame_apart_find_it_too(speed_m_s: float) -> None:
    rig = ring_rig(2)
    truth = state(SECOND_NS, (0.2, -0.1, 0.1), (12.0, -8.0, 130.0), (speed_m_s, 0.0, 0.0))
    times_ns = {0: SECOND_NS, 1: SECOND_NS + 16_700_000}
    found = started(first_state(seen(truth, rig, times_ns), rig, PROCESS))
    assert found.t_ns == times_ns[1]
    error = difference(at(truth, found.t_ns), found)
    assert np.abs(error[:3]).max() < 3.0 * np.sqrt(found.P[0, 0])
    together = started(first_state(seen(truth, rig, {0: SECOND_NS, 1: SECOND_NS}), rig, PROCESS))
    slack_m = 0.0167 * PROCESS.initial_speed_m_s
    assert np.sqrt(found.P[0, 0]) == pytest.approx(np.sqrt(together.P[0, 0]) + slack_m)


def test_one_camera_alone_cannot_start_a_track() -> None:
    rig = ring_rig(2)
    found = first_state(seen(TRUTH, rig, {1: 7}), rig, PROCESS)
    assert isinstance(found, Rejected)
    assert (found.reason, found.t_ns) == (Reason.NOT_FOUND, 7)
    assert "one camera" in found.detail


def test_a_ball_that_only_one_camera_sees_is_named() -> None:
    rig = ring_rig(2)
    whole = dict(seen(TRUTH, rig, {0: 5, 1: 9}))
    frame, blobs = whole[1]
    whole[1] = (frame, [blobs[0], [], blobs[2]])
    found = first_state(whole, rig, PROCESS)
    assert isinstance(found, Rejected)
    assert (found.reason, found.t_ns) == (Reason.NOT_FOUND, 9)
    assert "green" in found.detail


def test_rays_that_pass_each_other_are_no_ball() -> None:
    """40 px across the epipolar planes, which lie level in these images, are 100 mm at the balls."""
    rig = ring_rig(2)
    whole = dict(seen(TRUTH, rig, {0: 5, 1: 5}))
    frame, blobs = whole[1]
    shift_px = np.array([40.0, 0.0])
    whole[1] = (frame, [[Blob(frozen_array(b.uv_px + shift_px), b.area_px) for b in each] for each in blobs])
    found = first_state(whole, rig, replace(PROCESS, clock_offset_s=0.0))
    assert isinstance(found, Rejected)
    assert found.reason is Reason.NOT_FOUND


def test_a_marker_on_end_is_told_to_be_singular() -> None:
    rig = ring_rig(2)
    upright = state(SECOND_NS, euler_deg=(0.0, 90.0, 0.0))
    found = first_state(seen(upright, rig, {0: SECOND_NS, 1: SECOND_NS}), rig, PROCESS)
    assert isinstance(found, Rejected)
    assert found.reason is Reason.SINGULAR
