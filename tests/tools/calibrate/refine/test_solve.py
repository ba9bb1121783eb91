"""Bumped cameras in drawn rooms: found again, and by no more off than is said."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.rigs import ring_rig, state
from tools.calibrate.refine.certainty import BIAS_PX, alike
from tools.calibrate.refine.equations import SIGMA_PX, Unknowns, equations
from tools.calibrate.refine.evidence import Instant
from tools.calibrate.refine.solve import Refined, refine
from tracker.camera import Camera
from tracker.health.sample import MOTION
from tracker.maths import so3
from tracker.rig import Rig, make_rig
from tracker.types import Array, BallSighting, frozen_array

ROOMS, INSTANTS, PERIOD_NS = 12, 100, 133_333_333
STAND = np.repeat([0.001, np.radians(0.02)], 3)  # one sigma of the cameras that did not move
CLOCK_S = 0.02


def stood(camera: Camera, motion: Array) -> Camera:
    """Return a camera after a motion (6,) in W."""
    return replace(
        camera,
        p_CinW=frozen_array(camera.p_CinW + motion[:3]),
        R_CtoW=frozen_array(so3.exp(motion[3:]) @ camera.R_CtoW),
    )


def flight(true: Rig, offsets_s: Array, kept: float, rng: np.random.Generator) -> Iterator[Instant]:
    """Yield what cameras see of a vehicle that sways, off by a bias and by noise of which a share is kept a round."""
    shape = (len(true.cameras), len(true.marker), 2)
    bias_px, noise_px = rng.normal(scale=BIAS_PX, size=shape), rng.normal(scale=SIGMA_PX, size=shape)
    speed, phase, reach = 2.0 * np.pi * rng.uniform(0.1, 0.4, 6), rng.uniform(0.0, 6.0, 6), np.repeat([0.4, 0.3], 3)
    for k in range(INSTANTS):
        t_s = k * PERIOD_NS * 1e-9
        p_m, turn = np.split(reach * np.sin(speed * t_s + phase), 2)
        v_m_s = (reach * speed * np.cos(speed * t_s + phase))[:3]
        R = so3.exp(turn)
        noise_px = kept * noise_px + np.sqrt(1.0 - kept**2) * rng.normal(scale=SIGMA_PX, size=shape)
        sightings = []
        for c, camera in enumerate(true.cameras):
            balls_inW = true.marker.points_inB @ R.T + p_m + v_m_s * offsets_s[c]
            for ball, uv_px in enumerate(camera.project(balls_inW)[0] + bias_px[c] + noise_px[c]):
                cov_px = frozen_array(0.01**2 * np.eye(2))
                sightings.append(BallSighting(c, ball, k * PERIOD_NS, frozen_array(uv_px), cov_px))
        guess = state(k * PERIOD_NS, v_BinW=v_m_s, cameras=len(true.cameras)).with_parts(p_BinW=p_m, R_BtoW=R)
        yield Instant(guess, tuple(sightings))


def drawn(cameras: int, kept: float, seed: int) -> tuple[Refined, Array]:
    """Bump camera 0 of a room whose others stand about where they are said to; return what was found, and its error."""
    rng = np.random.default_rng((seed, cameras))
    said = ring_rig(cameras)
    bump = np.concatenate((rng.normal(scale=0.005, size=3), rng.normal(scale=np.radians(0.3), size=3)))
    motions = [bump, *(rng.normal(scale=STAND) for _ in range(cameras - 1))]
    true = make_rig(tuple(map(stood, said.cameras, motions)), said.marker)
    offsets_s = np.append(0.0, rng.normal(scale=0.005, size=cameras - 1))
    found = refine(
        list(flight(true, offsets_s, kept, rng)),
        said,
        Unknowns(cameras, (0,), CLOCK_S),
        dict.fromkeys(range(1, cameras), STAND),
    )
    camera, truth = found.cameras[0], true.cameras[0]
    turned = so3.log(camera.R_CtoW @ truth.R_CtoW.T)
    return found, np.concatenate((camera.p_CinW - truth.p_CinW, turned, (found.offsets_s - offsets_s)[1:]))


@pytest.mark.parametrize(("cameras", "kept"), [(2, 0.0), (4, 0.9)])
def test_over_many_rooms_errors_are_as_large_as_said(cameras: int, kept: float) -> None:
    """Mean NEES is one for each unknown; the upper bound is four sigma for as many rooms, and caution has its limit."""
    nees = []
    for seed in range(ROOMS):
        found, error = drawn(cameras, kept, seed)
        nees.append(float(error @ np.linalg.solve(found.covariance, error)))
    size = MOTION + cameras - 1
    assert 0.5 < np.mean(nees) / size < 1.0 + 4.0 * np.sqrt(2.0 / (size * ROOMS))


def test_rounds_that_err_alike_count_for_fewer() -> None:
    """Of noise of which a share is kept each round, (1 + kept) / (1 - kept) rounds tell what one alone does."""
    rig, known = ring_rig(2), Unknowns(2, (0,), 0.0)
    for kept, least, most in ((0.0, 1.0, 2.0), (0.8, 4.0, 14.0)):
        of = equations(list(flight(rig, np.zeros(2), kept, np.random.default_rng(4))), rig, known)
        assert least <= alike(of, len(rig.marker)) < most


def test_known_clocks_are_left_alone() -> None:
    rig = ring_rig(3)
    instants = list(flight(rig, np.zeros(3), 0.0, np.random.default_rng(1)))
    found = refine(instants, rig, Unknowns(3, (2,), 0.0), {})
    assert found.covariance.shape == (MOTION, MOTION)
    assert [camera.clock_offset_ns for camera in found.cameras] == [0, 0, 0]
    assert found.clock_sigma_s(2) == 0.0
