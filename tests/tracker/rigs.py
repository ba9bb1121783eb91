"""Rooms, movements and measurements drawn from the filter's own model, for the tracker's tests."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from tests.tracker.paper_rig import paper_camera, paper_rig
from tracker.filter.manoeuvre import start_levels
from tracker.filter.noise import start_noise
from tracker.maths import so3
from tracker.rig import Ball, Marker, Rig, make_marker, make_rig
from tracker.state import ATTITUDE, POSITION, RATE, VELOCITY, Process, State, mean_of
from tracker.tuning import Tuning
from tracker.types import Array, BallSighting, frozen_array

SECOND_NS = 1_000_000_000
PROCESS = Process(
    acceleration_m_s2=10.0,
    angular_acceleration_rad_s2=40.0,
    manoeuvre_s=0.4,
    initial_speed_m_s=2.5,
    initial_rate_rad_s=1.6,
    tilt_rad=np.radians(20.0),
    tilt_s=0.5,
    clock_offset_s=0.02,
    pixel_noise_px=0.1,
)
TUNING = Tuning(
    process=PROCESS,
    gate_probability=0.999,
    sync_window_ns=4_000_000,
    coast_limit_ns=200_000_000,
    continuity_limit_ns=1_000_000_000,
    tilt_limit_rad=np.radians(60.0),
)


def ring_rig(camera_count: int) -> Rig:
    """Return the paper's marker in a ring of cameras that all look at the room's origin."""
    azimuths_deg = np.linspace(45.0, 405.0, camera_count, endpoint=False)
    cameras = tuple(paper_camera(f"cam{i}", a, (-0.1, 0.02, 0.0002, -0.0004)) for i, a in enumerate(azimuths_deg))
    return make_rig(cameras, paper_rig().marker)


def moved_marker(marker: Marker, R: Array, p_m: Array, order: Iterable[int] = (0, 1, 2)) -> Marker:
    """Return the same balls in another body frame, turned by R (3, 3) and moved by p_m (3,), in another order."""
    balls = (marker.balls[i] for i in order)
    return make_marker(tuple(Ball(b.name, frozen_array(R @ b.p_inB + p_m), b.radius_m, b.colour) for b in balls))


def state(
    t_ns: int = 0,
    p_BinW: Iterable[float] = (0.0, 0.0, 0.0),
    euler_deg: Iterable[float] = (0.0, 0.0, 0.0),
    v_BinW: Iterable[float] = (0.0, 0.0, 0.0),
    w_BinB: Iterable[float] = (0.0, 0.0, 0.0),
    P: Array | None = None,
    cameras: int = 2,
) -> State:
    """Return a state; its covariance is that of a track that has settled unless told otherwise."""
    R_BtoW = so3.from_euler(*np.radians(tuple(euler_deg)))
    place, speed, rate = (np.array(tuple(part)) for part in (p_BinW, v_BinW, w_BinB))
    return State(
        t_ns,
        mean_of(place, R_BtoW, speed, rate, np.zeros(cameras)),
        covariance(0.002, 0.02, 0.1, 0.5) if P is None else P,
        levels=start_levels(),
        noise=start_noise(2, 0.0001),
        manoeuvre_s=PROCESS.manoeuvre_s,
    )


def covariance(position_m: float, attitude_rad: float, speed_m_s: float, rate_rad_s: float) -> Array:
    """Return P (25, 25) for two cameras of these sigmas, with next to no acceleration, jerk and offset."""
    motion = np.repeat([position_m, attitude_rad, speed_m_s, rate_rad_s, *[1e-6] * 4], 3)
    return np.diag(np.append(motion, 1e-9) ** 2)


def at(truth: State, t_ns: int) -> State:
    """Carry a state to t_ns at constant velocity and body rate, by scipy's rotations."""
    dt = (t_ns - truth.t_ns) * 1e-9
    turn = Rotation.from_rotvec(dt * truth.w_BinB).as_matrix()
    there = truth.with_parts(p_BinW=truth.p_BinW + dt * truth.v_BinW, R_BtoW=truth.R_BtoW @ turn)
    return replace(there, t_ns=t_ns)


def seen_px(truth: State, rig: Rig, camera: int, t_ns: int) -> Array:
    """Return where a camera sees the balls of a vehicle that keeps velocity and rate, (n, 2) [px]."""
    then = at(truth, t_ns)
    return rig.cameras[camera].project(rig.marker.points_inB @ then.R_BtoW.T + then.p_BinW)[0]


def sightings(
    truth: State, rig: Rig, views: Iterable[tuple[int, int]], sigma_px: float, rng: np.random.Generator | None = None
) -> tuple[BallSighting, ...]:
    """Return what the cameras see, views being (camera, t_ns); without a generator it is exact."""
    found = []
    for camera, t_ns in views:
        for ball, uv_px in enumerate(seen_px(truth, rig, camera, t_ns)):
            noise = np.zeros(2) if rng is None else rng.normal(scale=sigma_px, size=2)
            cov_px = frozen_array(sigma_px**2 * np.eye(2))
            found.append(BallSighting(camera, ball, t_ns, frozen_array(uv_px + noise), cov_px))
    return tuple(found)


def difference(truth: State, guess: State) -> Array:
    """Return the error (12,) that, put into `guess`, makes `truth` of it."""
    error = np.empty(12)
    error[POSITION] = truth.p_BinW - guess.p_BinW
    error[ATTITUDE] = Rotation.from_matrix(guess.R_BtoW.T @ truth.R_BtoW).as_rotvec()
    error[VELOCITY] = truth.v_BinW - guess.v_BinW
    error[RATE] = truth.w_BinB - guess.w_BinB
    return error


def perturbed(truth: State, error: Array) -> State:
    """Put an error, of which the first 12 count, into a state, by scipy's rotations."""
    return truth.with_parts(
        p_BinW=truth.p_BinW + error[POSITION],
        R_BtoW=truth.R_BtoW @ Rotation.from_rotvec(error[ATTITUDE]).as_matrix(),
        v_BinW=truth.v_BinW + error[VELOCITY],
        w_BinB=truth.w_BinB + error[RATE],
    )
