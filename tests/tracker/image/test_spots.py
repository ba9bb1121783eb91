"""Compiled spots against OpenCV's own HSV boxes and connected components, pixel for pixel."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.tracker.paper_rig import paper_rig
from tracker.image.colour_table import colours_of
from tracker.image.detect import Region, spots_in
from tracker.image.spots import ASPECT_MAX, FILL_MIN, MIN_AREA_PX
from tracker.rig import Ball, Colour
from tracker.types import Image

BALLS = paper_rig().marker.balls
RED = Colour(358.0, 12.0, 0.5, 0.2, (24, 20, 200))
ANY_HUE = Colour(90.0, 180.0, 0.3, 0.1, (0, 0, 0))
ANYTHING = Colour(0.0, 20.0, 0.0, 0.0, (0, 0, 0))
PAINTS = (*BALLS, *(replace(BALLS[0], colour=colour) for colour in (RED, ANY_HUE, ANYTHING)))
MOST_PX = 400.0


def mask_of(image: Image, colour: Colour) -> Image:
    """Return where an image has a colour, by OpenCV's HSV; hues wrap round at 180 half degrees."""
    hsv = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2HSV)).astype(np.int64)
    low = round((colour.hue_deg - colour.hue_tolerance_deg) / 2.0)
    high = round((colour.hue_deg + colour.hue_tolerance_deg) / 2.0)
    right_hue = sum((hsv[..., 0] + turn >= low) & (hsv[..., 0] + turn <= high) for turn in (-180, 0, 180)) > 0
    bright = hsv[..., 2] >= round(colour.value_min * 255)
    return np.asarray(right_hue & bright & (hsv[..., 1] >= round(colour.saturation_min * 255)), dtype=np.uint8)


def by_opencv(image: Image, region: Region, ball: Ball) -> list[tuple[float, float, float]]:
    """Return u, v and area of a colour's blobs in a region, in no order that matters."""
    part = np.ascontiguousarray(image[region.top : region.bottom, region.left : region.right])
    _, _, stats, centroids = cv2.connectedComponentsWithStats(mask_of(part, ball.colour), connectivity=8)
    blobs = []
    for (_, _, width, height, area), (u, v) in zip(stats[1:].tolist(), centroids[1:].tolist(), strict=True):
        disc = area >= FILL_MIN * width * height and max(width, height) <= ASPECT_MAX * min(width, height) + 1
        if MIN_AREA_PX <= area <= MOST_PX and disc:
            blobs.append((area, u + region.left, v + region.top))
    return sorted(blobs)


def random_image(rng: np.random.Generator, coarse: int) -> Image:
    """Return an image (240, 320, 3) of random colours, blotches of some `coarse` pixels."""
    small = rng.integers(0, 256, (240 // coarse, 320 // coarse, 3), dtype=np.uint8)
    return np.asarray(cv2.resize(small, (320, 240), interpolation=cv2.INTER_CUBIC), dtype=np.uint8)


def assert_same(image: Image, region: Region, balls: tuple[Ball, ...]) -> int:
    """Compare a region's spots with OpenCV's and return how many there are."""
    found = spots_in(image, region, colours_of(balls), MOST_PX)
    assert (np.diff(found[:, 3]) <= 0.0).all()
    for k, ball in enumerate(balls):
        ours = sorted((area, u, v) for _, u, v, area in found[found[:, 0] == k].tolist())
        theirs = by_opencv(image, region, ball)
        assert len(ours) == len(theirs)
        assert np.allclose(ours, theirs, rtol=0.0, atol=1e-9)
    return len(found)


@pytest.mark.parametrize("coarse", [1, 2, 5, 12, 20])
def test_whole_images_of_random_colours_have_the_blobs_that_opencv_finds(coarse: int) -> None:
    rng = np.random.default_rng(coarse)
    whole = Region(0, 0, 320, 240)
    assert sum(assert_same(random_image(rng, coarse), whole, PAINTS) for _ in range(3)) > 30


def test_regions_have_the_blobs_that_opencv_finds_in_them_however_they_are_cut() -> None:
    rng = np.random.default_rng(1)
    image = random_image(rng, 6)
    found = 0
    for _ in range(200):
        left, top = (int(x) for x in rng.integers(0, (319, 239)))
        region = Region(left, top, min(320, left + int(rng.integers(1, 60))), min(240, top + int(rng.integers(1, 60))))
        found += assert_same(image, region, (PAINTS[int(rng.integers(len(PAINTS)))],))
    assert found > 100


def test_every_colour_there_is_counts_as_it_does_in_hsv() -> None:
    green_red = np.stack(np.meshgrid(np.arange(256), np.arange(256), indexing="ij"), axis=-1).astype(np.uint8)
    palette = colours_of(PAINTS)
    for blue in range(0, 256, 5):
        image = np.concatenate((np.full((256, 256, 1), blue, np.uint8), green_red), axis=2)
        hue = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)[..., 0]
        value, spread = image.max(axis=2), np.ptp(image, axis=2)
        for k, ball in enumerate(PAINTS):
            ours = (spread >= palette.least_spread[k][value]) & palette.hues[k][hue]
            assert np.array_equal(ours, mask_of(image, ball.colour).astype(bool))


def test_an_empty_region_has_no_spots_and_one_beyond_the_image_is_refused() -> None:
    image = random_image(np.random.default_rng(0), 5)
    assert len(spots_in(image, Region(7, 7, 7, 9), colours_of(BALLS), MOST_PX)) == 0
    for beyond in (Region(-1, 0, 5, 5), Region(0, 0, 321, 5), Region(0, 230, 5, 241), Region(9, 0, 5, 5)):
        with pytest.raises(ValueError, match="beyond an image of 320 x 240 px"):
            spots_in(image, beyond, colours_of(BALLS), MOST_PX)


def test_images_that_are_views_or_read_only_are_searched_as_they_are() -> None:
    image = random_image(np.random.default_rng(2), 8)
    frozen = image.copy()
    frozen.flags.writeable = False
    view = np.zeros((240, 640, 3), np.uint8)[:, ::2]
    view[:] = image
    whole = Region(0, 0, 320, 240)
    expected = spots_in(image, whole, colours_of(BALLS), MOST_PX)
    assert len(expected) > 10
    assert np.array_equal(spots_in(frozen, whole, colours_of(BALLS), MOST_PX), expected)
    assert np.array_equal(spots_in(view, whole, colours_of(BALLS), MOST_PX), expected)
