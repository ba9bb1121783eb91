"""From whole frames to a first state: no track needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from tracker.cadence import TOGETHER_NS
from tracker.filter.manoeuvre import start_levels
from tracker.filter.noise import start_noise
from tracker.image.detect import Blob
from tracker.rig import Rig
from tracker.start.associate import associate
from tracker.start.pose3 import pose
from tracker.start.triangulate import MISS_SIGMA, meetings
from tracker.state import Process, State, mean_of, start_covariance
from tracker.types import Array, Frame, Point, Reason, Rejected

CENTROID_SIGMA_PX = 0.7  # of a colour blob's centroid, blur and shading included
MAX_CANDIDATES = 8  # per ball and camera, largest first
TRIGGERED_S = 1e-4  # one sigma of what is left between the clocks of cameras with one trigger
START_POSITION_M, START_ATTITUDE_RAD = 0.05, 0.3  # broad against the first fit, narrow against the room

Seen = Mapping[int, tuple[Frame, Sequence[Sequence[Blob]]]]
"""By camera: its newest frame, and for each ball of the marker the blobs of its colour in it."""


def first_state(seen: Seen, rig: Rig, process: Process) -> State | Rejected:
    """Find the marker among the blobs of two or more cameras.

    Returns:
        State at the newest frame's time, broad enough for a first update with sub-pixel sightings; Rejected when
        fewer than two cameras have frames or nothing in them is the marker.
    Source: the paper, section 3: triangulation, then eq. 4-6.
    """
    times = [frame.t_ns for frame, _ in seen.values()]
    newest_ns = max(times)
    if len(seen) < 2:
        return Rejected(Reason.NOT_FOUND, "one camera alone cannot start a track", newest_ns)
    apart_ns = newest_ns - min(times) + max(abs(rig.cameras[camera].readout_ns) for camera in seen)
    slack_m = (apart_ns * 1e-9 + process.clock_offset_s) * process.initial_speed_m_s
    points = [_places(ball, seen, rig, slack_m) for ball in range(len(rig.marker))]
    chosen = associate(points, rig.marker, slack_m)
    if isinstance(chosen, Rejected):
        return Rejected(chosen.reason, chosen.detail, newest_ns)
    found = pose(np.stack([point.p_inW for point in chosen]), rig.marker)
    if isinstance(found, Rejected):
        return Rejected(found.reason, found.detail, newest_ns)
    p_BinW, R_BtoW = found
    places = rig.marker.points_inB @ R_BtoW.T + p_BinW
    for ball, point, place in zip(rig.marker.balls, chosen, places, strict=True):
        miss_m = float(np.linalg.norm(point.p_inW - place))
        if miss_m > slack_m + MISS_SIGMA * float(np.sqrt(np.trace(point.covariance))):
            detail = f"{ball.name} stands {miss_m * 1e3:.0f} mm from its place on the marker: mirrored or mistaken"
            return Rejected(Reason.GEOMETRY, detail, newest_ns)
    return State(
        newest_ns,
        mean_of(p_BinW, R_BtoW, offsets_s=np.zeros(len(rig.cameras))),
        start_covariance(process, _clock_sigmas(seen, rig, process), START_POSITION_M + slack_m, START_ATTITUDE_RAD),
        levels=start_levels(),
        noise=start_noise(len(rig.cameras), process.pixel_noise_px),
        manoeuvre_s=process.manoeuvre_s,
    )


def together(frames: Sequence[Frame]) -> bool:
    """Say whether frames come from one trigger."""
    times = [frame.t_ns for frame in frames]
    return max(times) - min(times) <= TOGETHER_NS


def _clock_sigmas(seen: Seen, rig: Rig, process: Process) -> Array:
    """Return one sigma of the clock offset of each camera but the first [s].

    Cameras that stamp the same instant to a few microseconds have one trigger and one clock between them.
    """
    stamps = {camera: frame.t_ns for camera, (frame, _) in seen.items()}
    sigmas = np.full(len(rig.cameras) - 1, process.clock_offset_s)
    for camera in range(1, len(rig.cameras)):
        if camera in stamps and 0 in stamps and abs(stamps[camera] - stamps[0]) <= TOGETHER_NS:
            sigmas[camera - 1] = min(TRIGGERED_S, process.clock_offset_s)
    return sigmas


def _places(ball: int, seen: Seen, rig: Rig, slack_m: float) -> list[Point]:
    """Return where rays of one ball's colour from two cameras meet, best first."""
    found = []
    rays = {camera: _rays(camera, blobs[ball], rig) for camera, (_, blobs) in seen.items() if blobs[ball]}
    for a, b in combinations(sorted(rays), 2):
        first, second = rig.cameras[a], rig.cameras[b]
        sigma = CENTROID_SIGMA_PX / min(first.focal_px, second.focal_px)
        found += meetings(rays[a], rays[b], np.stack((first.p_CinW, second.p_CinW)), sigma, slack_m)
    return sorted(found, key=lambda point: point.miss_m)


def _rays(camera: int, blobs: Sequence[Blob], rig: Rig) -> Array:
    """Return the bearings (n, 3) in W to the largest blobs."""
    uv_px = np.array([blob.uv_px for blob in blobs[:MAX_CANDIDATES]])
    return np.ascontiguousarray(rig.cameras[camera].bearings(uv_px) @ rig.cameras[camera].R_CtoW.T)
