"""The bound against a fit that knows everything, and the noise it rests on against noise that was made."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.stats import chi2

from tools.bench.bound import parameter_bound, pose_bound
from tools.bench.noise import TO_YCC, Noise, measure_noise
from tools.bench.profile import TERMS, Disc, Drawn, columns, draw
from tracker.types import Array, Image

HALF = 8
BALL = np.array([90.0, 8.0, -12.0, 40.0, 3.0, -2.0])
ROOM = np.array([70.0, 5.0, -3.0])
SIGMA = 2.5


def disc_of(streak_px: tuple[float, float]) -> Disc:
    return Disc(2.8, streak_px, 0.45)


def derivatives(drawn: Drawn) -> tuple[Array, Array]:
    """Return the expected image's slopes by the centre (n, 2), and by brightness and background (n, 4)."""
    uncovered = -drawn.slopes[0] * (columns(drawn, HALF)[:, TERMS:] / (1.0 - drawn.shapes[0])[:, None] @ ROOM)[:, None]
    by_centre = np.einsum("t,tnk->nk", BALL, drawn.slopes) + uncovered
    return by_centre, np.column_stack((BALL @ drawn.shapes, columns(drawn, HALF)[:, TERMS:]))


@pytest.mark.parametrize("streak_px", [(0.0, 0.0), (2.0, -1.0)])
def test_slopes_of_the_drawn_ball_are_those_of_finite_differences(streak_px: tuple[float, float]) -> None:
    disc, at, step = disc_of(streak_px), np.array([0.2, -0.3]), 1.0 / 7.0
    drawn = draw(disc, at, HALF)
    for k in range(2):
        shift = step * np.eye(2)[k]
        difference = (draw(disc, at + shift, HALF).shapes - draw(disc, at - shift, HALF).shapes) / (2.0 * step)
        np.testing.assert_allclose(drawn.slopes[:, :, k], difference, atol=0.02)


def test_a_drawn_ball_covers_its_disc_about_its_centre() -> None:
    cover = draw(disc_of((0.0, 0.0)), np.array([0.3, -0.2]), HALF).shapes[0].reshape(2 * HALF + 1, -1)
    rows, cols = np.indices(cover.shape) - HALF
    assert cover.sum() == pytest.approx(np.pi * 2.8**2, rel=0.005)
    assert (cover * cols).sum() / cover.sum() == pytest.approx(0.3, abs=0.003)
    assert (cover * rows).sum() / cover.sum() == pytest.approx(-0.2, abs=0.003)


@pytest.mark.parametrize("streak_px", [(0.0, 0.0), (2.0, -1.0)])
def test_a_fit_that_knows_the_profile_has_the_variance_of_the_bound(streak_px: tuple[float, float]) -> None:
    """Gauss-Newton from the truth on 300 noisy images; its errors, by the bound, are chi-square within 99.9 %."""
    rng, disc, runs = np.random.default_rng(5), disc_of(streak_px), 300
    truth = np.array([0.15, -0.25])
    expected = columns(draw(disc, truth, HALF), HALF) @ np.concatenate((BALL, ROOM))
    by_centre, others = derivatives(draw(disc, truth, HALF))
    bound = parameter_bound(by_centre / SIGMA, others / SIGMA)
    J = np.column_stack((by_centre, others))
    total = 0.0
    for _ in range(runs):
        image = expected + rng.normal(scale=SIGMA, size=len(expected))
        step = np.linalg.lstsq(J, image - expected, rcond=None)[0]
        again = draw(disc, truth + step[:2], HALF)
        centre_J, other_J = derivatives(again)
        brightness = 1.0 + step[2]
        model = brightness * (BALL @ again.shapes) + columns(again, HALF)[:, TERMS:] @ (ROOM + step[3:])
        more = np.linalg.lstsq(np.column_stack((centre_J, other_J)), image - model, rcond=None)[0]
        error = step[:2] + more[:2]
        total += float(error @ np.linalg.solve(bound, error))
    low, high = chi2.ppf((0.0005, 0.9995), 2 * runs)
    assert low < total < high


def test_what_is_not_known_costs_and_what_is_square_to_it_does_not() -> None:
    wanted = np.array([[1.0], [1.0], [0.0]])
    square, shared = np.array([[1.0], [-1.0], [0.0]]), np.array([[1.0], [0.0], [0.0]])
    assert parameter_bound(wanted, square) == pytest.approx(0.5)
    assert parameter_bound(wanted, shared) == pytest.approx(1.0)


def test_the_pose_bound_is_the_covariance_of_a_weighted_fit() -> None:
    rng = np.random.default_rng(3)
    J, runs = rng.normal(size=(6, 2, 6)), 2000
    factors = rng.normal(size=(6, 2, 2)) + 2.0 * np.eye(2)
    bounds = factors @ factors.transpose(0, 2, 1)
    P = pose_bound(J, bounds)
    gains = P @ J.transpose(0, 2, 1) @ np.linalg.inv(bounds)
    noise = (factors @ rng.normal(size=(runs, 6, 2, 1)))[..., 0]
    found = np.einsum("nik,rnk->ri", gains, noise)
    total = float(np.einsum("ri,ij,rj->", found, np.linalg.inv(P), found))
    low, high = chi2.ppf((0.0005, 0.9995), 6 * runs)
    assert low < total < high


def still_images(blur_px: float, gain: float) -> list[Image]:
    """Make images of a still slope with noise of variance 4 + gain * level in each channel, blurred or not."""
    rng = np.random.default_rng(8)
    scene = np.broadcast_to(np.linspace(60.0, 160.0, 200)[None, :, None], (150, 200, 3))
    images = []
    for _ in range(5):
        noise = rng.normal(size=scene.shape)
        if blur_px:
            noise = gaussian_filter(noise, (blur_px, blur_px, 0.0))
            noise /= noise.std()
        images.append(np.clip(np.rint(scene + np.sqrt(4.0 + gain * scene) * noise), 0, 255).astype(np.uint8))
    return images


def measured(images: list[Image]) -> Noise:
    everywhere = np.ones(images[0].shape[:2], dtype=bool)
    return measure_noise([(before, after, everywhere) for before, after in pairwise(images)])


def test_noise_is_measured_as_it_was_made() -> None:
    noise = measured(still_images(0.0, 0.04))
    made = (4.0 + 0.04 * 110.0 + 1.0 / 12.0) * TO_YCC.T @ TO_YCC
    found = noise.axes @ np.diag(noise.variances) @ noise.axes.T
    np.testing.assert_allclose(found, made, atol=0.25)
    start, slope = noise.rise
    assert slope / start == pytest.approx(0.04 / 4.083, rel=0.25)
    lags = noise.correlations.copy()
    lags[:, 2, 2] = 0.0
    assert np.abs(lags).max() < 0.03


def test_whitened_noise_is_white_though_neighbours_share_it() -> None:
    images = still_images(0.6, 0.0)
    noise = measured(images)
    whiteners = noise.whiteners(HALF)
    patches = []
    for v in range(0, 130, 17):
        for u in range(0, 180, 17):
            difference = (images[1][v : v + 17, u : u + 17].astype(float) - images[0][v : v + 17, u : u + 17]) @ TO_YCC
            luma = images[0][v : v + 17, u : u + 17].astype(float) @ TO_YCC[:, 0]
            flat = (difference / np.sqrt(2.0)).reshape(-1, 3, 1)
            patches.append(noise.whitened(flat, np.full(17 * 17, luma.mean()), whiteners))
    assert np.mean(np.square(patches)) == pytest.approx(1.0, abs=0.1)
