"""The cameras' places from the waved marker, against the truth of a simulation and the laws of the parts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.paper_rig import paper_rig
from tests.tracker.rigs import ring_rig
from tools.bench.calibration import errors_of
from tools.bench.waved import misplaced, watched
from tools.calibrate.room.bundle import stepped
from tools.calibrate.room.certainty import camera_covariance
from tools.calibrate.room.footage import watch
from tools.calibrate.room.gauge import aligned
from tools.calibrate.room.jacobian import CAMERA, Layout, residuals, slopes
from tools.calibrate.room.rigid import rigid
from tools.calibrate.room.scene import Scene, Seen, common_instants
from tools.calibrate.room.solve import find_cameras, refined
from tools.calibrate.room.start import first_scene
from tools.calibrate.room.tracks import Track
from tracker.errors import OperatorError
from tracker.maths import so3
from tracker.rig import Rig, make_rig
from tracker.scene import Look
from tracker.sources.waving import waved


def _scene(rig: Rig, instants: int, rng: np.random.Generator) -> tuple[Scene, Seen]:
    """Return a scene, and sightings of it that are a little off."""
    R = np.stack([so3.exp(v) for v in rng.normal(scale=0.4, size=(instants, 3))])
    p = rng.uniform(-0.4, 0.4, (instants, 3))
    scene = Scene(rig.cameras, np.zeros(len(rig.cameras)), np.array(rig.marker.points_inB), p, R)
    places = scene.balls_inW()
    uv = np.stack([c.project(places.reshape(-1, 3))[0].reshape(instants, -1, 2) for c in rig.cameras])
    seen = Seen(
        np.arange(float(instants)),
        scene.offsets_s,
        uv + rng.normal(size=uv.shape),
        50.0 * uv / uv.max(),
        np.ones(uv.shape[:3]),
    )
    return scene, seen


@pytest.mark.parametrize(
    ("cameras", "seed", "look"),
    [
        (2, 1, Look()),
        (2, 5, Look()),
        (2, 6, Look(jpeg_quality=90)),
        (2, 1, Look(jpeg_quality=75)),
        (3, 2, Look()),
        (4, 1, Look(jpeg_quality=90)),
    ],
)
def test_misplaced_cameras_are_found_again_within_what_is_said_of_them_and_so_are_their_clocks(
    cameras: int, seed: int, look: Look
) -> None:
    true = paper_rig() if cameras == 2 else ring_rig(cameras)
    late_ns = (0, 8_000_000, -5_000_000, 3_000_000)[:cameras]
    said, footage = watched(true, seed, look, 20.0, late_ns)
    found = find_cameras(footage, said)
    off_m, off_rad = errors_of(found, true)
    off_s = np.array([camera.clock_offset_ns for camera in found.cameras]) * 1e-9 - np.array(late_ns) * 1e-9
    assert np.linalg.norm(off_m, axis=1).max() < 0.002
    assert np.linalg.norm(off_rad, axis=1).max() < math.radians(0.05)
    assert np.abs(off_s).max() < 0.0005
    sigmas = np.sqrt(np.diag(camera_covariance(found.adjusted))).reshape(cameras, CAMERA)
    assert (np.linalg.norm(off_m, axis=1) < 3.0 * np.linalg.norm(sigmas[:, :3], axis=1)).all()
    assert (np.linalg.norm(off_rad, axis=1) < 3.0 * np.linalg.norm(sigmas[:, 3:6], axis=1)).all()
    assert (np.abs(off_s[1:]) < 4.0 * sigmas[1:, 6]).all()


def drawn_track(rig: Rig, c: int, late_s: float, rng: np.random.Generator) -> Track:
    """Return what one camera sees of the waved marker at 15 Hz for 20 s, with noise, its clock being late."""
    t_s = np.arange(300) / 15.0
    p, R = (np.stack(values) for values in zip(*map(waved(3), (t_s + late_s).tolist()), strict=True))
    balls_inW = rig.marker.points_inB @ np.swapaxes(R, 1, 2) + p[:, None, :]
    uv_px = rig.cameras[c].project(balls_inW.reshape(-1, 3))[0].reshape(-1, len(rig.marker), 2)
    within = np.array([all(rig.cameras[c].sees(uv) for uv in balls) for balls in uv_px])
    noisy = uv_px[within] + rng.normal(scale=0.05, size=uv_px[within].shape)
    return Track(t_s[within], noisy, np.full(noisy.shape[:2], 0.05))


def test_eight_cameras_are_found_together() -> None:
    true, rng = ring_rig(8), np.random.default_rng(8)
    late_s = np.append(0.0, rng.uniform(-0.012, 0.012, 7))
    tracks = [drawn_track(true, c, late, rng) for c, late in enumerate(late_s.tolist())]
    seen = common_instants(tracks, 200, np.zeros(8))
    said = make_rig(tuple(misplaced(camera, rng) for camera in true.cameras), true.marker)
    scene, seen = first_scene(seen, said)
    found = refined(tracks, seen.t_s, scene, said)
    off_m, off_rad = errors_of(found, true)
    assert np.linalg.norm(off_m, axis=1).max() < 0.002
    assert np.linalg.norm(off_rad, axis=1).max() < math.radians(0.05)
    off_s = np.array([camera.clock_offset_ns for camera in found.cameras]) * 1e-9 - late_s
    assert np.abs(off_s).max() < 0.0005


def test_a_camera_that_shares_too_little_is_named() -> None:
    rig = paper_rig()
    with pytest.raises(OperatorError, match="cam1 saw all balls together with another camera in 0 instants"):
        find_cameras(watch(iter(()), rig, 1.0), rig)


def test_the_jacobian_is_the_slope_of_the_residuals() -> None:
    scene, seen = _scene(ring_rig(3), 4, np.random.default_rng(1))
    seen.uv_px[1, 2] = np.nan
    layout = Layout(3, 3, 4, lenses=True, marker=True)
    J = slopes(scene, seen, layout)
    for k in range(layout.size):
        step = np.zeros(layout.size)
        step[k] = 1e-6
        ahead, behind = (residuals(stepped(scene, s, layout), seen) for s in (step, -step))
        np.testing.assert_allclose(J[:, [k]].toarray()[:, 0], (ahead - behind) / 2e-6, rtol=1e-5, atol=1e-3)


def test_a_rigid_motion_is_found_and_a_mirror_never() -> None:
    rng = np.random.default_rng(2)
    points, R, p = rng.normal(size=(5, 4, 3)), so3.exp(np.array([0.3, -1.0, 2.0])), np.array([1.0, 2.0, 3.0])
    found_R, found_p = rigid(points, points @ R.T + p)
    np.testing.assert_allclose(found_R, np.broadcast_to(R, found_R.shape), atol=1e-12)
    np.testing.assert_allclose(found_p, np.broadcast_to(p, found_p.shape), atol=1e-12)
    assert np.linalg.det(rigid(points, points * [1.0, 1.0, -1.0])[0]) == pytest.approx(1.0)


def test_between_frames_a_cubic_is_met_exactly_and_over_a_gap_nothing_is_said() -> None:
    t_s = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.7, 0.8, 0.9, 1.0])
    track = Track(t_s, np.stack([t_s**3, 2.0 * t_s], axis=1)[:, None, :], np.ones((9, 1)))
    uv, speed, _ = track.at(np.array([0.15, 0.2, 0.55, 0.85, 0.97]))
    np.testing.assert_allclose(uv[[0, 1, 3], 0, 0], np.array([0.15, 0.2, 0.85]) ** 3, atol=1e-12)
    np.testing.assert_allclose(speed[[0, 1, 3], 0], [[3 * t * t, 2.0] for t in (0.15, 0.2, 0.85)], atol=1e-10)
    assert np.isnan(uv[[2, 4]]).all()


def test_a_scene_is_aligned_as_a_whole() -> None:
    scene, _ = _scene(ring_rig(4), 3, np.random.default_rng(3))
    R, p = so3.exp(np.array([0.1, 2.0, -0.4])), np.array([3.0, -1.0, 0.5])
    away = tuple(replace(c, R_CtoW=R @ c.R_CtoW, p_CinW=R @ c.p_CinW + p) for c in scene.cameras)
    moved = aligned(scene, away)
    np.testing.assert_allclose(moved.balls_inW(), scene.balls_inW() @ R.T + p, atol=1e-12)
