"""A ball fitted as its camera encodes light, and what that tells of the camera."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tracker.drawing import through_jpeg
from tests.tracker.paper_rig import paper_rig
from tools.bench.waved import watched
from tools.calibrate.room.again import again, taught
from tools.calibrate.room.encoded import ALL, BLUR, GAMMA, OWN, PAINT, PLANES, SHAPES, U, V, differentiate
from tools.calibrate.room.encoding import NOTHING, Encoding, fitted
from tools.calibrate.room.gamma import SMOOTHED, learned
from tracker.image.appearance import Appearance
from tracker.image.centre import numbers_of
from tracker.image.harmonics import TERMS, terms_at
from tracker.image.light import Light
from tracker.image.newton import draw_at, rows_of
from tracker.image.patch import Expected, Response
from tracker.image.reading import LUMA_VAR
from tracker.image.template import template_for, variance_of
from tracker.scene import Look
from tracker.types import Array

RIG = paper_rig()
CAMERA = RIG.cameras[0]
GAMMA_OF_SCREENS = 2.2
RADIUS_PX, SIZE_PX = 4.0, 48
LAMP = np.array([0.22, -0.37, 0.9])
LIGHT = Light(terms=np.where(np.arange(TERMS) < 9, terms_at(LAMP[None])[:, 0], 0.0), count=100)
KNOWN = Appearance(Response(gamma=GAMMA_OF_SCREENS), LIGHT, LIGHT)
SHADES = KNOWN.shades(CAMERA, 0.0, 0.0)
EXPECTED = Expected((SIZE_PX / 2, SIZE_PX / 2), RADIUS_PX, (0.0, 0.0), SHADES, KNOWN.response)


def unknowns() -> Array:
    """Return those of a ball before a wall (ALL,)."""
    at = np.zeros(ALL)
    at[:PLANES], at[U], at[V], at[GAMMA], at[BLUR], at[PAINT:] = (90.0, 20.0), 0.02, -0.03, 2.2, 0.16, (0.1, 0.4, 0.9)
    at[PLANES:U] = np.tile((60.0, 0.5, -0.3), 3)
    return at


def levels_with(at: Array) -> tuple[Array, Array]:
    """Return the grey levels (3, n) of a ball with such unknowns (ALL,), and their slopes (ALL, 3, n)."""
    y, x = np.mgrid[:SIZE_PX, :SIZE_PX] - float(SIZE_PX // 2)
    pixels, numbers = np.array((x.ravel(), y.ravel())), numbers_of(EXPECTED)
    numbers[LUMA_VAR] = variance_of(0.0, 1) + at[BLUR]
    template, drawn = template_for(RADIUS_PX, 0.4, SHADES), np.empty((rows_of(SHAPES), pixels.shape[1]))
    draw_at(pixels, *template, numbers, LUMA_VAR, at[U], at[V], drawn)
    channels = np.zeros((ALL + 1, 3, pixels.shape[1]))
    differentiate(pixels, drawn, at[:OWN].copy(), at[PAINT:].copy(), at[GAMMA], channels)
    return channels[ALL], channels[:ALL]


def test_slopes_by_every_unknown_are_those_of_finite_differences() -> None:
    at = unknowns()
    _, slopes = levels_with(at)
    for k, step in enumerate(np.where(np.isin(np.arange(ALL), (U, V)), 1e-2, 1e-3)):
        aside = step * np.eye(ALL)[k]
        found = (levels_with(at + aside)[0] - levels_with(at - aside)[0]) / (2.0 * step)
        assert np.abs(found - slopes[k]).max() < 0.05 * np.abs(slopes[k]).max()


def test_a_ball_kept_as_jpeg_is_found_to_a_thirtieth_of_a_pixel() -> None:
    rng, errors = np.random.default_rng(4), []
    for _ in range(40):
        at = unknowns()
        at[[U, V]] = rng.uniform(-0.5, 0.5, 2)
        at[PLANES:U:3] = rng.uniform(20.0, 90.0) * rng.uniform(0.7, 1.3, 3)
        levels, _ = levels_with(at)
        image = through_jpeg(np.rint(levels.T.reshape(SIZE_PX, SIZE_PX, 3)).astype(np.uint8), 95)
        known = Encoding(KNOWN, SMOOTHED, at[None, PAINT:])
        found = fitted(image, EXPECTED, known, 0, NOTHING)
        assert found is not None
        errors.append(found.uv_px - EXPECTED.uv_px - at[[U, V]])
    assert np.sqrt((np.array(errors) ** 2).mean()) < 1.0 / 30.0


@pytest.mark.parametrize("gamma", [1.0, 2.2])
def test_gamma_is_told_through_jpeg_by_all_sightings_together(gamma: float) -> None:
    _, footage = watched(RIG, 4, Look(jpeg_quality=90, gamma=gamma), 8.0, (0, 0))
    cameras = again(footage, RIG)
    for told in learned(cameras, taught(cameras)):
        assert told is not None
        assert told.gamma == pytest.approx(gamma, abs=0.5)


def test_a_camera_that_keeps_colour_by_the_pixel_needs_none_of_it() -> None:
    _, footage = watched(RIG, 4, Look(), 5.0, (0, 0))
    cameras = again(footage, RIG)
    assert learned(cameras, taught(cameras)) == [None, None]
