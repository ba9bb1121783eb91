"""Where bumped cameras stand now, by what all cameras saw of the balls; those that were not bumped hold the room.

Source: Gauss-Newton on the motions of the cameras and on the clocks, the vehicle's pose at each instant taken out of
    the equations as in `tracker.health.sample`, with Cauchy's weights: a sighting s sigmas off counts
    1 / (1 + s^2 / CAUCHY^2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tools.calibrate.refine.certainty import Held, covariance_of
from tools.calibrate.refine.equations import Equation, Unknowns, equations, normal
from tools.calibrate.refine.evidence import Instant
from tracker.camera import Camera
from tracker.health.sample import MOTION
from tracker.maths import so3
from tracker.rig import Rig
from tracker.state import OFFSETS
from tracker.types import Array, frozen_array

STEPS, ENOUGH = 8, 1e-3  # how many at most, and a step that is no more, in sigmas
NS = 1e9


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """What was found.

    cameras: all of the rig, the bumped ones mended, their clocks as found.
    offsets_s (cameras,): by how much later each sees than the rig knew, by camera 0's clock; 0 where clocks are known.
    covariance (size, size): of the unknowns in the order of `Unknowns`: places in W [m], turns in W [rad], clocks [s].
    off_mm: how far off the vehicle stood by the cameras as they were, mean.
    places_mm (m,): what its place is known to by the mended ones at each instant, one sigma, of the whole distance.
    rays_mm: of each bumped camera, how far its rays may miss the vehicle, one sigma, rms.
    """

    cameras: tuple[Camera, ...]
    unknowns: Unknowns
    offsets_s: Array
    covariance: Array
    off_mm: float
    places_mm: Array
    rays_mm: tuple[float, ...]

    @property
    def sigma_mm(self) -> float:
        """Return what the vehicle's place is known to, rms over the flight."""
        return float(np.sqrt(np.mean(self.places_mm**2)))

    def clock_sigma_s(self, c: int) -> float:
        """Return one sigma of a camera's clock against camera 0's; 0 where it was known [s]."""
        at = self.unknowns.motions + c - 1
        return float(np.sqrt(self.covariance[at, at])) if c and self.unknowns.clock_s > 0.0 else 0.0


def refine(instants: Sequence[Instant], rig: Rig, unknowns: Unknowns, held: Held) -> Refined:
    """Find where the bumped cameras stand, and by how much the clocks differ.

    Args:
        instants: of the flight after the bump; their clock offsets are a first guess.
        held: what the cameras that did not move are known to.
    """
    now, done = rig, np.zeros(unknowns.size)
    instants, offsets_s = _with_one_offset(instants, len(rig.cameras))
    if unknowns.clock_s > 0.0:
        done[unknowns.motions :] = offsets_s[1:]
    for _ in range(STEPS):
        of = equations(instants, now, unknowns)
        N, g = normal(of, unknowns, done)
        step = np.asarray(np.linalg.solve(N, g), dtype=np.float64)
        done = done + step
        instants = [_stepped(each, step, unknowns) for each in of]
        now = replace(now, cameras=_moved(now.cameras, unknowns.bumped, step))
        if float(step @ N @ step) < ENOUGH**2:
            break
    of = equations(instants, now, unknowns)
    covariance = covariance_of(of, now, unknowns, done, held)
    offsets_s[1:] = done[unknowns.motions :] if unknowns.clock_s > 0.0 else 0.0
    effects = [each.at_vehicle() for each in of]
    off_mm = [1e3 * np.linalg.norm(effect[:, : unknowns.motions] @ done[: unknowns.motions]) for effect in effects]
    places_mm = 1e3 * np.sqrt([float(np.trace(effect @ covariance @ effect.T)) for effect in effects])
    return Refined(
        _timed(now.cameras, offsets_s), unknowns, offsets_s, covariance, float(np.mean(off_mm)), places_mm,
        tuple(_rays_mm(of, now, k, unknowns, covariance) for k in range(len(unknowns.bumped))),
    )  # fmt: skip


def with_offsets(instants: Sequence[Instant], offsets_s: Array) -> list[Instant]:
    """Return instants whose states have these clock offsets (cameras,) [s]."""
    return [replace(one, state=one.state.with_parts(offsets_s=offsets_s)) for one in instants]


def _with_one_offset(instants: Sequence[Instant], cameras: int) -> tuple[list[Instant], Array]:
    """Return the instants with the offsets that the flight found in the middle, which are one for all of it."""
    offsets_s = np.median([one.state.offsets_s for one in instants], axis=0) if instants else np.zeros(cameras)
    return with_offsets(instants, offsets_s), offsets_s


def _stepped(each: Equation, step: Array, unknowns: Unknowns) -> Instant:
    """Return an instant after a step: the vehicle's pose goes with it."""
    state = each.instant.state
    dx = np.zeros(OFFSETS + len(state.offsets_s) - 1)
    dx[:6] = each.pose(step)
    dx[OFFSETS : OFFSETS + unknowns.size - unknowns.motions] = step[unknowns.motions :]
    return replace(each.instant, state=state.moved(dx))


def _rays_mm(of: Sequence[Equation], rig: Rig, k: int, unknowns: Unknowns, covariance: Array) -> float:
    """Return how far a mended camera's rays may miss the vehicle, one sigma, rms.

    Source: a camera that goes by t and turns by w about its place p takes its ray past X by t + w x (X - p), across it.
    """
    camera, at = rig.cameras[unknowns.bumped[k]], slice(MOTION * k, MOTION * (k + 1))
    variances = []
    for each in of:
        arm = each.instant.state.p_BinW - camera.p_CinW
        ray = arm / np.linalg.norm(arm)
        M = (np.eye(3) - np.outer(ray, ray)) @ np.hstack((np.eye(3), -so3.hat(arm)))
        variances.append(float(np.trace(M @ covariance[at, at] @ M.T)))
    return 1e3 * float(np.sqrt(np.mean(variances)))


def _moved(cameras: tuple[Camera, ...], bumped: tuple[int, ...], step: Array) -> tuple[Camera, ...]:
    """Return the cameras after a motion of the bumped ones."""
    after = list(cameras)
    for k, index in enumerate(bumped):
        motion, camera = step[MOTION * k : MOTION * (k + 1)], cameras[index]
        after[index] = replace(
            camera,
            R_CtoW=frozen_array(so3.exp(motion[3:]) @ camera.R_CtoW),
            p_CinW=frozen_array(camera.p_CinW + motion[:3]),
        )
    return tuple(after)


def _timed(cameras: tuple[Camera, ...], offsets_s: Array) -> tuple[Camera, ...]:
    """Return the cameras with what was found of their clocks on top of what was known."""
    return tuple(
        replace(camera, clock_offset_ns=camera.clock_offset_ns + round(offset_s * NS))
        for camera, offset_s in zip(cameras, offsets_s.tolist(), strict=True)
    )
