"""The marker among spots of any colour: its sides say where it is, its colours' order says which ball is which."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tracker.camera import Camera
from tracker.palette.chroma import chroma, paint_of
from tracker.palette.spots import Spots
from tracker.rig import Marker, Rig
from tracker.start.acquire import CENTROID_SIGMA_PX
from tracker.start.associate import SIDE_SIGMA
from tracker.start.pose3 import pose
from tracker.start.triangulate import MISS_SIGMA, triangulate
from tracker.types import Array, Point, Rejected

CAST_SIGMA = 0.35  # of chroma, common to all balls of a camera: gains of 0.8 and 1.2 make 0.4
PAINT_SIGMA = 0.3  # of chroma, each ball's own: paint, light, black level
MOST_COLOUR = 9.0  # mean square of a ball's colour in sigma, above which it is another thing
SIZES = (0.5, 2.0)  # of a spot's radius, relative to a ball's at its place
CAST_BETWEEN = 0.9  # of chroma, between two cameras
MOST_POINTS = 160


@dataclass(frozen=True, slots=True, eq=False)
class Identified:
    """The marker in one instant.

    p_BinW (3,), R_BtoW (3, 3): its pose.  misfit: of sides and colours, in squared sigma.
    chroma: by camera, of each ball (n, 2), of the two cameras it was found by.
    """

    p_BinW: Array
    R_BtoW: Array
    misfit: float
    chroma: Mapping[int, Array]


@dataclass(frozen=True, slots=True, eq=False)
class _Meeting:
    """Where the rays of a spot in each of two cameras meet."""

    point: Point
    spots: tuple[int, int]


def identify(spots: Mapping[int, Spots], rig: Rig, slack_m: float, tilt_limit_rad: float) -> Identified | None:
    """Find the marker in one instant.

    Args:
        spots: by camera.
        slack_m: how far a ball may have moved between the cameras' pictures [m].
        tilt_limit_rad: a pose that leans further from upright is none.
    Returns:
        The pose whose sides and colours fit best, None if none does. The colours that the config names only rank the
        balls: each camera's colour cast is taken out first.
    """
    wanted = np.stack([chroma(paint_of(ball.colour)) for ball in rig.marker.balls]).astype(np.float64)
    best: Identified | None = None
    for a, b in combinations(sorted(spots), 2):
        meetings = _meetings((a, b), spots, rig, slack_m)
        for choice in _shaped([one.point for one in meetings], rig.marker, slack_m):
            seen = {
                camera: spots[camera].chroma[[meetings[k].spots[side] for k in choice]]
                for side, camera in enumerate((a, b))
            }
            colour = sum(colour_misfit(found, wanted) for found in seen.values())
            if colour > MOST_COLOUR * 4 * len(rig.marker) or (best is not None and colour >= best.misfit):
                continue
            found = _posed([meetings[k].point for k in choice], rig.marker, slack_m, tilt_limit_rad)
            if found is not None and (best is None or found[2] + colour < best.misfit):
                best = Identified(found[0], found[1], found[2] + colour, seen)
    return best


def ball_radius_m(rig: Rig) -> float:
    """Return the mean radius of the marker's balls [m]."""
    return float(np.mean([ball.radius_m for ball in rig.marker.balls]))


def expected_radius_px(rig: Rig, camera: Camera) -> float:
    """Return a ball's radius where the cameras look [px]: the point nearest their axes, or the nearest place to it."""
    M = np.array([np.eye(3) - np.outer(each.R_CtoW[:, 2], each.R_CtoW[:, 2]) for each in rig.cameras])
    centres = np.stack([each.p_CinW for each in rig.cameras])
    middle = np.linalg.lstsq(M.sum(axis=0), np.einsum("nij,nj->i", M, centres), rcond=None)[0]
    depth_m = float(camera.in_camera(middle[None])[0, 2])
    return float(np.clip(camera.focal_px * ball_radius_m(rig) / max(depth_m, 0.3), 1.2, 60.0))


def _meetings(pair: tuple[int, int], spots: Mapping[int, Spots], rig: Rig, slack_m: float) -> list[_Meeting]:
    """Return where spots of two cameras meet that are alike in colour and as large as balls, best first."""
    first, second = (rig.cameras[camera] for camera in pair)
    one, other = (spots[camera] for camera in pair)
    if not len(one) or not len(other):
        return []
    rays = [camera.bearings(each.uv_px) @ camera.R_CtoW.T for camera, each in ((first, one), (second, other))]
    across = np.cross(rays[0][:, None], rays[1][None])
    length = np.linalg.norm(across, axis=2)
    gap_m = np.abs(across @ (second.p_CinW - first.p_CinW)) / np.maximum(length, 1e-9)
    sigma = CENTROID_SIGMA_PX / min(first.focal_px, second.focal_px)
    reach_m = float(np.linalg.norm(second.p_CinW - first.p_CinW)) + 5.0  # generous: the exact test follows
    alike = np.linalg.norm(one.chroma[:, None] - other.chroma[None], axis=2) < CAST_BETWEEN
    found = []
    for i, j in np.argwhere(alike & (gap_m < 2.0 * slack_m + 4.0 * MISS_SIGMA * sigma * reach_m)).tolist():
        point = triangulate(np.stack((rays[0][i], rays[1][j])), np.stack((first.p_CinW, second.p_CinW)), sigma)
        if isinstance(point, Rejected):
            continue
        near = point.miss_m <= slack_m + MISS_SIGMA * float(np.sqrt(np.trace(point.covariance) / 3.0))
        if near and _sized(point, first, one.radius_px[i], rig) and _sized(point, second, other.radius_px[j], rig):
            found.append(_Meeting(point, (i, j)))
    return sorted(found, key=lambda meeting: meeting.point.miss_m)[:MOST_POINTS]


def _sized(point: Point, camera: Camera, radius_px: float, rig: Rig) -> bool:
    """Say whether a spot is about as large as a ball at its place, a pixel of blur aside."""
    expected_px = camera.focal_px * ball_radius_m(rig) / float(camera.in_camera(point.p_inW[None])[0, 2])
    return SIZES[0] * expected_px - 0.5 <= radius_px <= SIZES[1] * expected_px + 1.0


def _shaped(points: Sequence[Point], marker: Marker, slack_m: float) -> Iterator[tuple[int, ...]]:
    """Yield every choice of one point a ball, in the marker's order, that has the marker's sides."""
    if len(points) < len(marker):
        return
    places = np.stack([point.p_inW for point in points])
    spread = np.array([float(np.trace(point.covariance)) for point in points])
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    limit = SIDE_SIGMA * np.sqrt(spread[:, None] + spread[None] + slack_m**2)
    wanted = np.linalg.norm(marker.points_inB[:, None] - marker.points_inB[None], axis=2)
    fits = np.abs(apart[None, None] - wanted[:, :, None, None]) < limit  # (ball, ball, point, point)

    def grown(chosen: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
        ball = len(chosen)
        if ball == len(marker):
            yield chosen
            return
        free = np.ones(len(points), dtype=bool)
        for other, k in enumerate(chosen):
            free &= fits[other, ball, k]
            free[k] = False
        for k in np.flatnonzero(free).tolist():
            yield from grown((*chosen, k))

    yield from grown(())


def colour_misfit(found: Array, wanted: Array) -> float:
    """Return how little colours (n, 2) are the wanted ones under one cast, in squared sigma.

    The cast c that minimises sum |d_i - c|^2 / s^2 + |c|^2 / q^2 is the mean of d times n q^2 / (n q^2 + s^2).
    """
    d = found - wanted
    weight = len(d) * CAST_SIGMA**2 / (len(d) * CAST_SIGMA**2 + PAINT_SIGMA**2)
    cast = weight * d.mean(axis=0)
    return float(((d - cast) ** 2).sum() / PAINT_SIGMA**2 + (cast**2).sum() / CAST_SIGMA**2)


def _posed(
    points: Sequence[Point], marker: Marker, slack_m: float, tilt_limit_rad: float
) -> tuple[Array, Array, float] | None:
    """Return p_BinW, R_BtoW and the misfit in squared sigma of points that may be the marker, None if they are not."""
    found = pose(np.stack([point.p_inW for point in points]), marker)
    if isinstance(found, Rejected):
        return None
    p_BinW, R_BtoW = found
    if R_BtoW[2, 2] < np.cos(tilt_limit_rad):
        return None
    places = marker.points_inB @ R_BtoW.T + p_BinW
    errors2 = [
        float(((point.p_inW - place) ** 2).sum()) / (float(np.trace(point.covariance)) + slack_m**2)
        for point, place in zip(points, places, strict=True)
    ]
    return None if max(errors2) > MISS_SIGMA**2 else (p_BinW, R_BtoW, sum(errors2))
