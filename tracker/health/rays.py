"""How well the rays to the balls meet, and how far the balls they meet at stand apart: figures for the operator."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from tracker.maths import so3
from tracker.rig import Rig
from tracker.types import Array, BallSighting


def residuals(sightings: Sequence[BallSighting], rig: Rig) -> tuple[list[float], list[float]]:
    """Compare the sightings of one instant with each other, pair of cameras by pair, the vehicle's pose left aside.

    Returns:
        How far each ball lies off the plane of another camera's ray to it [px], and by how much each side of the
        triangle of triangulated balls is longer than on the marker [m].
    """
    off_px, longer_m = [], []
    rays_inW = _rays_inW(sightings, rig)
    for first, second in combinations(sorted({one.camera for one in sightings}), 2):
        base = rig.cameras[second].p_CinW - rig.cameras[first].p_CinW
        places = {}
        for ball in range(len(rig.marker)):
            if (first, ball) in rays_inW and (second, ball) in rays_inW:
                u, v = rays_inW[first, ball], rays_inW[second, ball]
                across = so3.hat(base) @ u
                off_px.append(rig.cameras[second].focal_px * float(v @ across) / math.sqrt(float(across @ across)))
                places[ball] = rig.cameras[first].p_CinW + _middle(base, u, v)
        for a, b in combinations(places, 2):
            side_m = float(np.linalg.norm(rig.marker.points_inB[a] - rig.marker.points_inB[b]))
            longer_m.append(float(np.linalg.norm(places[a] - places[b])) - side_m)
    return off_px, longer_m


def _rays_inW(sightings: Sequence[BallSighting], rig: Rig) -> dict[tuple[int, int], Array]:
    """Return the unit ray (3,) in W of each sighting, by camera and ball."""
    found: dict[tuple[int, int], Array] = {}
    for index in {one.camera for one in sightings}:
        seen, camera = [one for one in sightings if one.camera == index], rig.cameras[index]
        rays = camera.bearings(np.array([one.uv_px for one in seen])) @ camera.R_CtoW.T
        found |= {(index, one.ball): ray for one, ray in zip(seen, rays, strict=True)}
    return found


def _middle(base: Array, u: Array, v: Array) -> Array:
    """Return the point midway between the rays along u from the origin and along v from `base`, where they are nearest.

    Source: base + t v - s u is square to both.
    """
    cosine = float(u @ v)
    a, b = float(u @ base), float(v @ base)
    s, t = (a - cosine * b) / (1.0 - cosine**2), (cosine * a - b) / (1.0 - cosine**2)
    return np.asarray((s * u + base + t * v) / 2.0)
