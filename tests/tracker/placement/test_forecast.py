"""What cameras tell of a pose, against brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from tests.tracker.rigs import ring_rig
from tracker.camera import Camera
from tracker.maths import so3
from tracker.placement.forecast import ball_error, forecast, lever
from tracker.placement.mount import Box, Lens, aimed
from tracker.placement.views import Poses, Sharpness, attitudes_within, look, poses_of
from tracker.rig import Marker
from tracker.types import Array, frozen_array

RIG = ring_rig(2)
SHARP = Sharpness(lens_px=0.1, grey_noise=0.03, blur_px=0.5, least_radius_px=2.0)
VOLUME = Box("volume", np.array([-0.2, -0.2, -0.2]), np.array([0.2, 0.2, 0.2]))


def pixels(p: Array, R: Array, marker: Marker) -> Array:
    return np.concatenate([camera.project(p + marker.points_inB @ R.T)[0].ravel() for camera in RIG.cameras])


def one_pose(p: Array, R: Array) -> Poses:
    return Poses(p[None], R[None], 1)


def test_the_forecast_is_the_spread_of_poses_fitted_to_noisy_pixels() -> None:
    """Mean NEES over n fits is 6; the band is four sigma of such a mean."""
    p, R = np.array([0.1, -0.05, 0.08]), so3.from_euler(0.2, -0.1, 0.7)
    poses, trials = one_pose(p, R), 300
    views = [look(camera, RIG.marker, poses, SHARP) for camera in RIG.cameras]
    covariance = forecast(views, RIG.marker, poses).covariance[0]
    rng, truth = np.random.default_rng(3), pixels(p, R, RIG.marker)
    radii = [
        camera.focal_px * ball.radius_m / camera.in_camera((p + R @ ball.p_inB)[None])[0, 2]
        for camera in RIG.cameras
        for ball in RIG.marker.balls
    ]
    sigma = np.repeat(SHARP.sigma_px(np.array(radii)), 2)
    distances = []
    for _ in range(trials):
        seen = truth + sigma * rng.normal(size=len(truth))
        fit = least_squares(
            lambda e, seen=seen: (pixels(p + e[:3], R @ so3.exp(e[3:]), RIG.marker) - seen) / sigma, np.zeros(6)
        ).x
        distances.append(fit @ np.linalg.solve(covariance, fit))
    assert np.mean(distances) == pytest.approx(6.0, abs=4.0 * np.sqrt(12.0 / trials))


def test_information_is_the_slope_of_the_pixels() -> None:
    p, R = np.array([0.1, -0.05, 0.08]), so3.from_euler(0.2, -0.1, 0.7)
    camera = RIG.cameras[0]
    exact = replace(SHARP, lens_px=1.0, grey_noise=1e-9)
    H = np.empty((6, 6))
    for k in range(6):
        e = np.zeros(6)
        e[k] = 1e-6
        moved = [camera.project(p + s * e[:3] + RIG.marker.points_inB @ (R @ so3.exp(s * e[3:])).T)[0] for s in (1, -1)]
        H[:, k] = (moved[0] - moved[1]).ravel() / 2e-6
    found = look(camera, RIG.marker, one_pose(p, R), exact).information[0]
    np.testing.assert_allclose(found, H.T @ H, rtol=1e-5, atol=1e-3 * np.abs(found).max() * 1e-3)


def test_the_lever_turns_a_covariance_into_the_balls_error() -> None:
    poses = one_pose(np.zeros(3), so3.from_euler(0.1, 0.2, 0.3))
    root = np.random.default_rng(4).normal(size=(6, 6)) * 1e-4
    errors = np.random.default_rng(5).normal(size=(40_000, 6)) @ root.T
    R, points = poses.R_BtoW[0], RIG.marker.points_inB
    off = errors[:, None, :3] + np.cross(errors[:, None, 3:], points[None]) @ R.T
    drawn = np.sqrt((off**2).sum(axis=2).mean())
    assert ball_error(root @ root.T, lever(RIG.marker, poses)[0]) == pytest.approx(drawn, rel=0.02)


def test_a_ball_behind_another_is_pictured_but_not_seen() -> None:
    """Seen level from the side, the marker's two front balls lie in one line."""
    camera = aimed("", np.array([-3.0, -0.046188, 0.0]), np.array([0.0, -0.046188, 0.0]), Lens(30.0, 640, 480))
    view = look(camera.camera("cam"), RIG.marker, one_pose(np.zeros(3), np.eye(3)), SHARP)
    assert view.pictured.tolist() == [[True, True, True]]
    assert view.seen.tolist() == [[True, False, True]]


@pytest.mark.parametrize(
    ("place", "target"),
    [((0.0, -3.0, 0.0), (0.0, -6.0, 0.0)), ((0.0, -3.0, 0.0), (3.0, 0.0, 0.0)), ((0.0, -9.0, 0.0), (0.0, 0.0, 0.0))],
    ids=["behind", "beside the picture", "too small"],
)
def test_what_is_not_in_the_picture_tells_nothing(place: tuple[float, ...], target: tuple[float, ...]) -> None:
    camera = aimed("", np.array(place), np.array(target), Lens(30.0, 640, 480)).camera("cam")
    view = look(camera, RIG.marker, one_pose(np.zeros(3), np.eye(3)), SHARP)
    assert not view.pictured.any()
    assert not view.information.any()


def test_a_distorted_lens_folds_nothing_from_far_outside_into_its_picture() -> None:
    straight = RIG.cameras[0]
    barrel: Camera = replace(straight, distortion=frozen_array((-0.6, 0.0, 0.0, 0.0)))
    side = straight.R_CtoW[:, 0]
    poses = poses_of(np.array([k * side for k in np.linspace(2.0, 8.0, 40)]), [np.eye(3)])
    assert not look(barrel, RIG.marker, poses, SHARP).pictured.any()


def test_of_two_equally_far_cameras_those_at_a_right_angle_know_the_position_best() -> None:
    """The paper's section 2.2, by covariance: with axes theta apart its trace goes as 1/2 + 2 / sin^2 theta."""
    angles, poses = np.radians([50.0, 70.0, 90.0, 110.0, 130.0]), poses_of(np.zeros((1, 3)), attitudes_within(0.3, 8))
    errors = []
    for angle in angles:
        turns = (-angle / 2.0, angle / 2.0)
        cameras = [
            aimed("", 3.0 * np.array([np.cos(t), np.sin(t), 0.0]), np.zeros(3), Lens(30.0, 640, 480)).camera("cam")
            for t in turns
        ]
        views = [look(camera, RIG.marker, poses, replace(SHARP, lens_px=1.0)) for camera in cameras]
        errors.append(float(np.sqrt((forecast(views, RIG.marker, poses).position_m ** 2).mean())))
    assert int(np.argmin(errors)) == 2


def test_one_camera_covers_nothing_and_two_do() -> None:
    poses = poses_of(VOLUME.points(0.2), attitudes_within(0.3, 4))
    views = [look(camera, RIG.marker, poses, SHARP) for camera in RIG.cameras]
    assert not forecast(views[:1], RIG.marker, poses).covered.any()
    assert forecast(views, RIG.marker, poses).covered.all()


def test_twice_the_noise_is_twice_the_error() -> None:
    poses = poses_of(VOLUME.points(0.2), attitudes_within(0.3, 4))
    twice = replace(SHARP, lens_px=0.2, grey_noise=0.06)
    once, more = (
        forecast([look(camera, RIG.marker, poses, sharp) for camera in RIG.cameras], RIG.marker, poses)
        for sharp in (SHARP, twice)
    )
    np.testing.assert_allclose(more.position_m, 2.0 * once.position_m, rtol=1e-3)
    np.testing.assert_allclose(more.attitude_rad, 2.0 * once.attitude_rad, rtol=1e-3)


def test_a_camera_placed_as_the_papers_is_the_papers() -> None:
    ours = aimed("", RIG.cameras[0].p_CinW, np.zeros(3), Lens(30.0, 640, 480)).camera("cam0")
    np.testing.assert_allclose(ours.R_CtoW, RIG.cameras[0].R_CtoW, atol=1e-9)
    np.testing.assert_allclose(ours.K, RIG.cameras[0].K, atol=1e-6)
