"""The filter's own figures of its errors, on flights that no filter chose: as they say, within what they say."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from tests.tracker.rigs import PROCESS, difference, perturbed, ring_rig, state
from tracker.filter.ekf import Update, update
from tracker.filter.manoeuvre import start_levels
from tracker.filter.noise import start_noise
from tracker.filter.predict import first_guess, predict
from tracker.sources.paths import PATHS, PathFunction
from tracker.state import OFFSETS, State, mean_of, start_covariance
from tracker.types import Array, BallSighting, frozen_array

RIG = ring_rig(2)
SIGMA_PX, FIT_PX = 0.03, 0.015
RATE_HZ = 15.0
SETTLED_S = 1.0
RUNS = 50
POSE_LIMIT = float(chi2.isf(5.7e-7, 6))  # five sigma
Hidden = Callable[[int, float], Sequence[int]]


@dataclass(frozen=True)
class Row:
    """One update: time since the start [s], errors (12,), their sigmas, NEES / 3 of each block (4,), NIS / dof.

    pose2: squared Mahalanobis distance of the pose's error.
    """

    t_s: float
    error: Array
    sigma: Array
    nees: Array
    nis: float
    pose2: float
    state: State


def truth_at(path: PathFunction, t_s: float) -> State:
    """Return the pose of a path, and its velocity and rate by central differences."""
    step = 1e-4
    (p, R), (before, turned), (after, turning) = path(t_s), path(t_s - step), path(t_s + step)
    w_BinB = Rotation.from_matrix(turned.T @ turning).as_rotvec() / (2.0 * step)
    return State(round(t_s * 1e9), mean_of(p, R, (after - before) / (2.0 * step), w_BinB), np.eye(12))


def seen(
    path: PathFunction, camera: int, t_s: float, stamp_ns: int, rng: np.random.Generator, shake_px: float
) -> list[BallSighting]:
    p, R = path(t_s)
    uv_px = RIG.cameras[camera].project(RIG.marker.points_inB @ R.T + p)[0] + rng.normal(scale=SIGMA_PX, size=(3, 2))
    uv_px += rng.normal(scale=shake_px, size=2) if shake_px else 0.0
    cov_px = frozen_array(FIT_PX**2 * np.eye(2))
    return [BallSighting(camera, ball, stamp_ns, frozen_array(uv), cov_px) for ball, uv in enumerate(uv_px)]


def flown(
    path: PathFunction,
    seed: int,
    duration_s: float,
    apart_s: float = 0.0,
    offset_s: float = 0.0,
    hidden: Hidden = lambda _camera, _t_s: (),
    shakes_px: tuple[float, float] = (0.0, 0.0),
    clock_s: float = PROCESS.clock_offset_s,
) -> list[Row]:
    """Fly a path and track it by noisy sightings.

    apart_s: how much later than camera 0 camera 1 takes its pictures.  offset_s: how much later than it says.
    hidden: balls that a camera (index) does not see at a time [s].
    shakes_px: by how much each camera's frames are off, all balls alike, one sigma on each axis.
    clock_s: one sigma of what is known of camera 1's clock.
    """
    rng, rows, now = np.random.default_rng(seed), [], None
    begin_s = 5.0 + rng.uniform(0.0, 5.0)
    for k in range(round(duration_s * RATE_HZ)):
        for lag_s, cameras in ((0.0, (0, 1)),) if apart_s == 0.0 else ((0.0, (0,)), (apart_s, (1,))):
            t_s = begin_s + k / RATE_HZ + lag_s
            t_ns = round(t_s * 1e9)
            truth = truth_at(path, t_ns * 1e-9)
            found = [s for c in cameras for s in seen(path, c, t_ns * 1e-9 + c * offset_s, t_ns, rng, shakes_px[c])]
            found = [s for s in found if s.ball not in hidden(s.camera, t_s - begin_s)]
            ahead = first_guess(first(truth, rng, clock_s), PROCESS) if now is None else predict(now, t_ns, PROCESS)
            result = update(ahead, tuple(found), RIG, 0.999)
            if isinstance(result, Update):
                now = result.state
                rows.append(row_of(t_s - begin_s, truth, result))
    return rows


def first(truth: State, rng: np.random.Generator, clock_s: float) -> State:
    """Return a first guess near the truth, as whole frames give it."""
    rough = perturbed(truth, rng.normal(size=12) * np.repeat([0.001, 0.01, 0.0, 0.0], 3))
    offset_s = np.full(1, clock_s)
    return State(
        rough.t_ns, mean_of(rough.p_BinW, rough.R_BtoW, offsets_s=np.zeros(2)),
        start_covariance(PROCESS, offset_s, 0.05, 0.3), start_levels(), start_noise(2, PROCESS.pixel_noise_px),
        PROCESS.manoeuvre_s,
    )  # fmt: skip


def row_of(t_s: float, truth: State, result: Update) -> Row:
    error, P = difference(truth, result.state), result.state.P
    blocks = [slice(i, i + 3) for i in (0, 3, 6, 9)]
    nees = [float(error[b] @ np.linalg.solve(P[b, b], error[b])) / 3.0 for b in blocks]
    pose2 = float(error[:6] @ np.linalg.solve(P[:6, :6], error[:6]))
    return Row(t_s, error, np.sqrt(np.diag(P)[:12]), np.array(nees), result.nis / result.dof, pose2, result.state)


def wandering(seed: int) -> PathFunction:
    """Return a flight of random sines below 1 Hz: 0.3 m, 10 deg and 1 rad of yaw, each one sigma."""
    rng = np.random.default_rng(1000 + seed)
    f_hz, phase, share = rng.uniform(0.1, 1.0, (6, 8)), rng.uniform(0.0, 2.0 * np.pi, (6, 8)), rng.normal(size=(6, 8))

    def path(t_s: float) -> tuple[Array, Array]:
        c = (share * np.sin(2.0 * np.pi * f_hz * t_s + phase)).sum(axis=1) / np.sqrt(8.0)
        return 0.3 * c[:3], state(0, euler_deg=np.degrees(c[3:] * [0.17, 0.17, 1.0])).R_BtoW

    return path


def settled(rows: list[Row]) -> list[Row]:
    return [row for row in rows if row.t_s > SETTLED_S]


@pytest.mark.parametrize("name", ["hover", "figure8", "fast"])
def test_position_and_attitude_err_as_the_covariance_says(name: str) -> None:
    """Mean NEES over 50 flights, within the 95 % band of 50 draws of 3 degrees of freedom."""
    rows = [row for seed in range(RUNS) for row in settled(flown(PATHS[name], seed, 3.0))]
    nees = np.mean([row.nees for row in rows], axis=0)
    assert (nees[:2] > 0.70).all()
    assert (nees[:2] < 1.33).all()
    assert (nees[2:] < 1.33).all()  # velocity and rate may be surer than they say
    assert np.mean([row.nis for row in rows]) < 1.15


def test_an_unknown_clock_offset_is_found_to_half_a_millisecond() -> None:
    for seed, offset_s in enumerate((0.03, -0.03, 0.012, 0.0)):
        last = flown(PATHS["figure8"], seed, 30.0, offset_s=offset_s)[-1].state
        assert abs(last.offsets_s[1] - offset_s) < 0.0005
        assert np.sqrt(last.P[OFFSETS, OFFSETS]) < 0.0005


@pytest.mark.parametrize("name", ["hover", "square", "figure8"])
def test_an_unknown_clock_offset_errs_as_its_sigma_says(name: str) -> None:
    """Mean squared error in sigmas over 20 flights, below the 95 % band's upper end; it may be surer than it says."""
    squares = []
    for seed in range(20):
        offset_s = float(np.random.default_rng(500 + seed).normal(scale=PROCESS.clock_offset_s))
        last = flown(PATHS[name], seed, 6.0, offset_s=offset_s)[-1].state
        squares.append((last.offsets_s[1] - offset_s) ** 2 / last.P[OFFSETS, OFFSETS])
    assert np.mean(squares) < chi2.ppf(0.975, 20) / 20


@pytest.mark.parametrize("seed", range(4))
def test_a_vehicle_that_stands_still_teaches_no_clock_offset(seed: int) -> None:
    last = flown(lambda _t_s: PATHS["hover"](0.0), seed, 8.0, offset_s=0.01)[-1].state
    assert np.sqrt(last.P[OFFSETS, OFFSETS]) > 0.99 * PROCESS.clock_offset_s
    assert abs(last.offsets_s[1]) < 0.1 * PROCESS.clock_offset_s


@pytest.mark.parametrize(("apart_s", "offset_s"), [(0.5 / RATE_HZ, 0.0), (0.5 / RATE_HZ, 0.02), (0.005, -0.005)])
def test_a_camera_that_looks_alone_makes_no_pose_wrong_when_the_track_starts_at_speed(
    apart_s: float, offset_s: float
) -> None:
    for seed in range(10):
        rows = flown(PATHS["fast"], seed, 2.0, apart_s=apart_s, offset_s=offset_s)
        assert max(row.pose2 for row in rows) < POSE_LIMIT, seed


def test_in_a_hover_the_unknown_offset_costs_nothing() -> None:
    rows = settled(flown(PATHS["hover"], 1, 6.0))
    assert np.linalg.norm([row.error[:3] for row in rows], axis=1).mean() < 0.00015


@pytest.mark.parametrize("seed", range(8))
def test_a_camera_blind_for_a_second_costs_what_the_covariance_says(seed: int) -> None:
    rows = flown(wandering(seed), seed, 6.0, hidden=lambda c, t_s: (0, 1, 2) if c == 1 and 3.0 < t_s < 4.0 else ())
    worst = max(float(np.abs(row.error / row.sigma)[:6].max()) for row in settled(rows))
    assert worst < 5.0
    assert len(rows) == 90
