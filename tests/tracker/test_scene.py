"""The renderer against geometry, paint and sensor physics; nothing here knows how balls are detected."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.tracker.paper_rig import paper_rig
from tracker.maths import so3
from tracker.rig import Rig
from tracker.scene import Lamp, Look, Occluder, Pose, SceneRenderer, Sphere, Trouble, hand
from tracker.scene.ball import BallPainter, RayMap
from tracker.scene.random_look import random_look
from tracker.sources.random_flight import random_flight
from tracker.types import Array, Image

HEIGHT, WIDTH = 480, 640
QUIET = Look(full_well_e=1e12, read_noise=0.0)


@pytest.fixture(scope="module")
def rig() -> Rig:
    return paper_rig()


def grey_room() -> list[Image]:
    return [np.full((HEIGHT, WIDTH, 3), 128, dtype=np.uint8)] * 2


def pose(x: float = 0.0, y: float = 0.0, z: float = 0.0, yaw: float = 0.3) -> Pose:
    return np.array([x, y, z]), so3.from_euler(0.1, -0.05, yaw)


def balls_px(rig: Rig, camera: int, at: Pose) -> Array:
    p_BinW, R_BtoW = at
    return rig.cameras[camera].project(rig.marker.points_inB @ R_BtoW.T + p_BinW)[0]


@pytest.mark.parametrize("camera", [0, 1])
def test_a_ball_covers_the_pixels_its_projection_says_to_a_fiftieth_of_a_pixel(rig: Rig, camera: int) -> None:
    """The cover's centroid lies at the projected centre and its area is that of the disc, lens distortion and all."""
    eye = rig.cameras[camera]
    painter = BallPainter(eye, RayMap(eye), [0.0075] * 3, [ball.colour.bgr for ball in rig.marker.balls], Look())
    rng = np.random.default_rng(1)
    for _ in range(40):
        x, y, z, yaw = rng.uniform((-0.3, -0.3, -0.3, -3.0), (0.3, 0.3, 0.3, 3.0)).tolist()
        at = pose(x, y, z, yaw)
        p_inW = rig.marker.points_inB @ at[1].T + at[0]
        p_inC, uv_px = eye.in_camera(p_inW), eye.project(p_inW)[0]
        for stamp, uv, point in zip(painter.paint(p_inC[None], uv_px[None])[0], uv_px, p_inC, strict=True):
            assert stamp is not None
            cover = stamp.layer[..., 3].astype(np.float64)
            rows, columns = np.indices(cover.shape)
            centroid = np.array([(cover * columns).sum(), (cover * rows).sum()]) / cover.sum()
            np.testing.assert_allclose(centroid + np.array([stamp.u_px, stamp.v_px]), uv, atol=0.02)
            disc_px2 = np.pi * (eye.focal_px * 0.0075 / point[2]) ** 2
            assert cover.sum() == pytest.approx(disc_px2, rel=0.03)


@pytest.mark.parametrize("camera", [0, 1])
def test_each_ball_shows_its_paints_hue_at_its_middle(rig: Rig, camera: int) -> None:
    image = SceneRenderer(rig, QUIET, seed=4, backdrops=grey_room()).render(camera, [pose()])
    hsv = cv2.cvtColor(image.astype(np.float32) / 255.0, cv2.COLOR_BGR2HSV)
    for ball, (u, v) in zip(rig.marker.balls, balls_px(rig, camera, pose()), strict=True):
        hue, saturation, _ = hsv[round(v), round(u)]
        assert hue == pytest.approx(ball.colour.hue_deg, abs=ball.colour.hue_tolerance_deg)
        assert saturation > ball.colour.saturation_min


def test_a_ball_is_lit_from_the_lamp_and_dark_on_the_other_side(rig: Rig) -> None:
    image = SceneRenderer(rig, QUIET, backdrops=grey_room()).render(0, [pose()])
    for u, v in balls_px(rig, 0, pose()).round().astype(int):
        assert image[v - 1, u].sum() > image[v + 1, u].sum()


def test_a_ball_hides_one_behind_it(rig: Rig) -> None:
    """Turn the marker so that green stands between camera 0 and yellow."""
    eye = rig.cameras[0]
    towards = (eye.p_CinW) / np.linalg.norm(eye.p_CinW)
    side = np.cross(towards, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(towards, [0.0, 0.0, 1.0]))
    R_BtoW = np.column_stack((towards, np.cross(side, towards), side))
    p_BinW = -(R_BtoW @ rig.marker.points_inB[:2].mean(axis=0))
    image = SceneRenderer(rig, QUIET, backdrops=grey_room()).render(0, [(p_BinW, R_BtoW)])
    u, v = balls_px(rig, 0, (p_BinW, R_BtoW))[1].round().astype(int)
    blue, green, red = image[v, u].astype(int)
    assert green > 1.5 * red
    assert green > 1.5 * blue


def test_motion_during_the_exposure_smears_the_picture_along_its_way(rig: Rig) -> None:
    """A still ball is as wide as high; one that moves 12 mm in the image's x direction is wider."""
    renderer = SceneRenderer(rig, QUIET, backdrops=grey_room())
    across = np.array([-1.0, 1.0, 0.0]) / np.sqrt(2.0)
    moving = [(pose()[0] + step * across, pose()[1]) for step in np.linspace(-0.006, 0.006, 7)]
    u, v = balls_px(rig, 0, pose())[1].round().astype(int)
    spread = []
    for poses in ([pose()], moving):
        patch = renderer.render(0, poses)[v - 9 : v + 10, u - 9 : u + 10].astype(np.float64)
        green = np.maximum(patch[..., 1] - patch[..., 2] - 20.0, 0.0)
        rows, columns = np.indices(green.shape) - 9.0
        spread.append(((green * columns**2).sum() / green.sum()) / ((green * rows**2).sum() / green.sum()))
    assert spread[1] > 1.3 * spread[0]


def test_the_same_seed_gives_the_same_bytes_and_another_seed_another_room(rig: Rig) -> None:
    first, again, other = (SceneRenderer(rig, seed=seed) for seed in (7, 7, 8))
    for camera in (0, 1, 0):
        picture = first.render(camera, [pose()])
        assert np.array_equal(picture, again.render(camera, [pose()]))
        assert not np.array_equal(picture, other.render(camera, [pose()]))


def test_two_frames_of_a_still_scene_differ_by_noise_of_the_deviation_the_sensor_has(rig: Rig) -> None:
    """sigma_display = d display / dL sqrt(L / full_well + read^2), plus 1/12 for the quantisation."""
    look = replace(Look(), blur_px=0.0)
    renderer = SceneRenderer(rig, look, backdrops=grey_room())
    far = [pose(x=50.0)]
    pictures = [renderer.render(0, far).astype(np.float64) for _ in range(2)]
    middle = np.s_[220:260, 300:340]
    measured = float((pictures[0][middle] - pictures[1][middle]).std() / np.sqrt(2.0))
    light = (128 / 255) ** 2.2
    slope = 255 / 2.2 * light ** (1 / 2.2 - 1)
    expected = np.sqrt(slope**2 * (light / look.full_well_e + look.read_noise**2) + 1 / 12)
    assert measured == pytest.approx(expected, rel=0.06)


@pytest.mark.parametrize("place", [(50.0, 0.0, 0.0), (5.0, 5.0, 5.0), (1.59, 1.59, 2.25), (0.0, 0.0, -2.0)])
def test_a_vehicle_out_of_sight_behind_or_at_the_camera_leaves_a_picture_all_the_same(
    rig: Rig, place: tuple[float, float, float]
) -> None:
    for camera in (0, 1):
        assert SceneRenderer(rig, backdrops=grey_room()).render(camera, [pose(*place)]).shape == (HEIGHT, WIDTH, 3)


def test_a_vehicle_half_out_of_the_picture_is_drawn_as_far_as_it_is_in(rig: Rig) -> None:
    with_vehicle, without = (SceneRenderer(rig, QUIET, backdrops=grey_room()) for _ in range(2))
    edge = pose(-0.60, 0.60, 0.0)
    difference = with_vehicle.render(0, [edge]) != without.render(0, [pose(x=50.0)])
    assert difference.any()
    assert not difference[:, :320].any() or not difference[:, 320:].any()


def test_less_light_makes_a_darker_picture(rig: Rig) -> None:
    renderer = SceneRenderer(rig, QUIET)
    bright, dim = (renderer.render(0, [pose()], Trouble(light_gain=gain)).mean() for gain in (1.0, 0.3))
    assert dim == pytest.approx(bright * 0.3 ** (1 / 2.2), rel=0.08)


def test_an_occluder_stands_before_its_own_camera_only(rig: Rig) -> None:
    u, v = balls_px(rig, 0, pose())[0].round().astype(int).tolist()
    trouble = Trouble(occluders=(Occluder(0, u - 8, v - 8, 16, 16, (10, 20, 30)),))
    renderer = SceneRenderer(rig)
    assert renderer.render(0, [pose()], trouble)[v, u].tolist() == [10, 20, 30]
    assert not (renderer.render(1, [pose()], trouble) == (10, 20, 30)).all(axis=2).any()


def test_a_jpeg_round_trip_changes_the_picture_a_little(rig: Rig) -> None:
    plain, packed = (
        SceneRenderer(rig, replace(QUIET, jpeg_quality=quality), seed=2).render(0, [pose()]).astype(int)
        for quality in (0, 90)
    )
    assert 0.0 < np.abs(plain - packed).mean() < 3.0


def quiet_picture(rig: Rig, trouble: Trouble, camera: int = 0, look: Look = QUIET) -> Array:
    rendered = SceneRenderer(rig, look, backdrops=grey_room()).render(camera, [pose()], trouble)
    return np.asarray(rendered, dtype=np.float64)


def test_linear_grey_levels_are_light_and_those_of_a_screen_are_its_root(rig: Rig) -> None:
    """Half the light: half the grey level, or 2 ** (-1 / 2.2) of it."""
    for gamma in (1.0, 2.2):
        look = replace(QUIET, gamma=gamma)
        full, half = (quiet_picture(rig, Trouble(light_gain=gain), look=look)[200, 100, 0] for gain in (1.0, 0.5))
        assert half / full == pytest.approx(0.5 ** (1.0 / gamma), rel=0.01)


def test_light_of_another_colour_changes_each_channel_by_its_own_factor(rig: Rig) -> None:
    linear = replace(QUIET, gamma=1.0)
    white, tinted = (
        quiet_picture(rig, trouble, look=linear)[100:140, 100:140].mean(axis=(0, 1))
        for trouble in (Trouble(), Trouble(gains_bgr=(1.2, 1.0, 0.8)))
    )
    assert (tinted / white).tolist() == pytest.approx([1.2, 1.0, 0.8], rel=0.01)


def test_the_light_is_as_before_when_the_trouble_is_over(rig: Rig) -> None:
    renderer = SceneRenderer(rig, replace(QUIET, chroma_noise=0.0), backdrops=grey_room())
    before, _, after = (renderer.render(0, [pose()], Trouble(light_gain=gain)) for gain in (1.0, 0.5, 1.0))
    assert np.array_equal(before, after)


@pytest.mark.parametrize("camera", [0, 1])
def test_a_thing_in_the_room_is_seen_where_it_stands_by_every_camera(rig: Rig, camera: int) -> None:
    p_inW = (0.2, -0.3, 0.1)
    picture = quiet_picture(rig, Trouble(things=(Sphere(p_inW, 0.0075, (17, 91, 205)),)), camera)
    difference = np.abs(picture - quiet_picture(rig, Trouble(), camera)).sum(axis=2)
    rows, columns = np.indices(difference.shape)
    centroid = np.array([(difference * columns).sum(), (difference * rows).sum()]) / difference.sum()
    np.testing.assert_allclose(centroid, rig.cameras[camera].project(np.array([p_inW]))[0][0], atol=0.7)


@pytest.mark.parametrize(("towards_m", "hidden"), [(0.3, True), (-0.3, False)])
def test_a_hand_before_the_marker_hides_it_and_one_behind_does_not(rig: Rig, towards_m: float, hidden: bool) -> None:
    eye = rig.cameras[0]
    green_inW = rig.marker.points_inB[1] @ pose()[1].T + pose()[0]
    to_camera = (eye.p_CinW - green_inW) / np.linalg.norm(eye.p_CinW - green_inW)
    trouble = Trouble(things=hand(green_inW + towards_m * to_camera, np.array([0.0, 0.0, 1.0])))
    u, v = balls_px(rig, 0, pose())[1].round().astype(int)
    blue, green, red = quiet_picture(rig, trouble)[v, u]
    assert (red > green > blue) == hidden


def test_a_ball_painted_anew_shows_the_other_colour(rig: Rig) -> None:
    paints = [ball.colour.bgr for ball in rig.marker.balls]
    swapped = quiet_picture(rig, Trouble(repainted=((1, paints[2]), (2, paints[1]))))
    for ball, other in ((1, 2), (2, 1)):
        u, v = balls_px(rig, 0, pose())[ball].round().astype(int)
        colour = swapped[v, u] / swapped[v, u].sum()
        np.testing.assert_allclose(colour, np.array(paints[other]) / sum(paints[other]), atol=0.12)


def test_a_broken_picture_is_whole_above_and_garbage_below(rig: Rig) -> None:
    whole, broken = (quiet_picture(rig, trouble) for trouble in (Trouble(), Trouble(broken_from=0.4)))
    assert np.array_equal(whole[:192], broken[:192])
    assert np.abs(whole[192:] - broken[192:]).mean() > 10.0


def test_a_lamp_that_hangs_near_lights_by_the_square_of_the_distance(rig: Rig) -> None:
    """Lit from where the camera stands, a ball is brightest in its middle, and as bright as the distance says."""
    eye, radius_m = rig.cameras[0], 0.0075
    x, y, z = (0.4 * eye.p_CinW).tolist()
    lamp = Lamp((x, y, z), 0.8)
    dark = replace(QUIET, ambient=0.0, diffuse=0.0, specular=0.0)
    painter = BallPainter(eye, RayMap(eye), [radius_m], [(255, 255, 255)], replace(dark, lamps=(lamp,)))
    for place in ((0.0, 0.0, 0.0), (0.0, 0.0, 0.3), (0.2, 0.1, 0.2)):
        p_inC, uv_px = eye.in_camera(np.array([place])), eye.project(np.array([place]))[0]
        stamp = painter.paint(p_inC[None], uv_px[None])[0][0]
        assert stamp is not None
        covered = stamp.layer[..., 3] > 0.99
        nearer = np.linalg.norm(lamp.p_inW) / np.linalg.norm(np.array(lamp.p_inW) - place)
        assert stamp.layer[..., :3][covered].max() == pytest.approx(0.8 * nearer**2, rel=0.05)


def test_balls_of_made_up_rooms_are_neither_full_nor_dark() -> None:
    for seed in range(50):
        look, path = random_look(seed, 1.0), random_flight(seed)
        assert look == random_look(seed, 1.0)
        for t_s in np.arange(0.0, 8.0, 0.2).tolist():
            place, _ = path(t_s)
            nearer = [np.linalg.norm(lamp.p_inW) / np.linalg.norm(lamp.p_inW - place) for lamp in look.lamps]
            lamps = sum(lamp.share * near**2 for lamp, near in zip(look.lamps, nearer, strict=True))
            assert 0.4 < look.ambient + 0.5 * (look.diffuse + lamps) < 1.2
    assert len({random_look(seed, 1.0) for seed in range(50)}) == 50
