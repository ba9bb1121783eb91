"""Blobs of the balls' colours, and what is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.drawing import developed, draw_ball, empty_canvas
from tests.tracker.paper_rig import paper_rig
from tracker.image.detect import Region, find_blobs, region_around
from tracker.rig import Ball, Colour
from tracker.types import Array, Image

RIG = paper_rig()
BALLS = RIG.marker.balls
RED = replace(BALLS[0], name="red", colour=Colour(358.0, 12.0, 0.5, 0.2, (24, 20, 200)))
LARGEST = 500.0


def picture(*balls: tuple[Ball, tuple[float, float], float]) -> Image:
    """Return an image with balls, each with its centre and radius [px]."""
    canvas = empty_canvas(RIG.cameras[0])
    for ball, uv_px, radius_px in balls:
        draw_ball(canvas, np.array(uv_px), radius_px, ball)
    return developed(canvas)


def test_each_ball_is_found_by_its_own_colour_alone() -> None:
    places = [(100.3, 200.7), (300.0, 50.5), (612.25, 400.1)]
    image = picture(*((ball, uv, 3.0) for ball, uv in zip(BALLS, places, strict=True)))
    found = find_blobs(image, None, BALLS, LARGEST)
    assert [len(blobs) for blobs in found] == [1, 1, 1]
    for blobs, uv_px in zip(found, places, strict=True):
        assert np.allclose(blobs[0].uv_px, uv_px, atol=0.7)
        assert 0.4 * np.pi * 9.0 < blobs[0].area_px < 1.6 * np.pi * 9.0


def test_an_empty_room_has_no_balls() -> None:
    assert find_blobs(picture(), None, BALLS, LARGEST) == [[], [], []]


def test_a_region_gives_the_whole_images_pixels_and_sees_nothing_else() -> None:
    image = picture((BALLS[1], (100.0, 200.0), 4.0), (BALLS[1], (300.0, 50.0), 4.0))
    ((blob,),) = find_blobs(image, Region(280, 30, 320, 70), (BALLS[1],), LARGEST)
    assert np.allclose(blob.uv_px, (300.0, 50.0), atol=0.5)


def test_the_largest_blob_comes_first_and_what_is_larger_than_a_ball_can_be_not_at_all() -> None:
    image = picture(*((BALLS[2], (100.0 * k, 100.0), 2.0 * k) for k in (1, 3, 2, 5)))
    (blobs,) = find_blobs(image, None, (BALLS[2],), np.pi * 8.0**2)
    assert [round(blob.uv_px[0] / 100.0) for blob in blobs] == [3, 2, 1]
    areas = [blob.area_px for blob in blobs]
    assert areas == sorted(areas, reverse=True)


@pytest.mark.parametrize("hue_deg", [0.0, 3.0, 352.0, 357.0])
def test_red_goes_round_the_end_of_the_hue_circle(hue_deg: float) -> None:
    ball = replace(RED, colour=replace(RED.colour, hue_deg=hue_deg))
    for bgr in ((24, 20, 200), (60, 20, 200), (20, 45, 200)):  # hues 359, 347 and 8 deg
        canvas = empty_canvas(RIG.cameras[0])
        canvas[100:110, 100:110] = bgr
        (blobs,) = find_blobs(developed(canvas), None, (ball,), LARGEST)
        high, low, middle = max(bgr), min(bgr), sorted(bgr)[1]
        hue = 60.0 * (middle - low) / (high - low) * (1 if bgr[1] > bgr[0] else -1)
        inside = abs((hue - hue_deg + 180.0) % 360.0 - 180.0)
        if inside < 10.5:
            assert len(blobs) == 1
        elif inside > 13.5:
            assert blobs == []


@pytest.mark.parametrize(
    ("size_px", "ball"),
    [((2, 40), False), ((40, 2), False), ((1, 3), False), ((12, 7), True), ((2, 2), True), ((9, 9), True)],
)
def test_a_stripe_or_a_speck_is_no_ball(size_px: tuple[int, int], ball: bool) -> None:
    canvas = empty_canvas(RIG.cameras[0])
    canvas[100 : 100 + size_px[0], 200 : 200 + size_px[1]] = BALLS[1].colour.bgr
    assert bool(find_blobs(developed(canvas), None, (BALLS[1],), LARGEST)[0]) is ball


def test_dark_and_pale_pixels_have_no_colour() -> None:
    canvas = empty_canvas(RIG.cameras[0])
    canvas[100:110, 100:110] = np.array(BALLS[1].colour.bgr) * 0.15
    canvas[100:110, 200:210] = 200.0 + 0.2 * np.array(BALLS[1].colour.bgr)
    assert find_blobs(developed(canvas), None, (BALLS[1],), LARGEST) == [[]]


@pytest.mark.parametrize(
    ("uv_px", "half_px", "expected"),
    [
        ((100.0, 50.0), (10.0, 5.0), Region(90, 45, 111, 56)),
        ((2.0, 478.5), (10.0, 5.0), Region(0, 473, 13, 480)),
        ((-20.0, 50.0), (10.0, 5.0), None),
        ((100.0, 600.0), (10.0, 5.0), None),
        ((645.0, 50.0), (10.0, 5.0), Region(635, 45, 640, 56)),
    ],
)
def test_a_region_is_cut_to_the_image(
    uv_px: tuple[float, float], half_px: tuple[float, float], expected: Region | None
) -> None:
    assert region_around(np.array(uv_px), np.array(half_px), 640, 480) == expected


def test_a_regions_pixels_hold_the_point_and_all_within_reach() -> None:
    rng = np.random.default_rng(1)
    for _ in range(100):
        uv_px: Array = rng.uniform((50, 50), (500, 400))
        half_px: Array = rng.uniform(1.0, 40.0, 2)
        region = region_around(uv_px, half_px, 640, 480)
        assert region is not None
        assert region.left <= uv_px[0] - half_px[0] < uv_px[0] + half_px[0] <= region.right - 1
        assert region.top <= uv_px[1] - half_px[1] < uv_px[1] + half_px[1] <= region.bottom - 1
