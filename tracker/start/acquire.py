"""From whole frames to a first state: no track needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from tracker.cadence import TOGETHER_NS
from tracker.filter.manoeuvre import start_levels
from tracker.filter.noise import start_noise
from tracker.image.detect import Blob
from tracker.image.nearest import LEAST_AREA_SHARE, MOST_AREA_SHARE
from tracker.rig import Rig
from tracker.start.associate import associate
from tracker.start.pose3 import pose
from tracker.start.triangulate import MISS_SIGMA, Rays, meetings
from tracker.state import Process, State, mean_of, start_covariance
from tracker.types import Array, Frame, Point, Reason, Rejected

CENTROID_SIGMA_PX = 0.7  # of a colour blob's centroid, blur and shading included
SPOT_SHARE = 0.5  # of a ball's radius: how far off its middle a spot's may be
MAX_SPOTS = 256  # per ball and camera of two, largest first: wood and bricks make hundreds of orange ones
MAX_PLACES = 512  # per ball, those first where rays miss each other least
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
    moved_m = (apart_ns * 1e-9 + process.clock_offset_s) * process.initial_speed_m_s
    found = _posed(seen, rig, _spot_error_m(rig)) if _one_trigger(seen, rig) else None
    if found is None or isinstance(found, Rejected):
        found = _posed(seen, rig, moved_m)
    if isinstance(found, Rejected):
        return Rejected(found.reason, found.detail, newest_ns)
    return State(
        newest_ns,
        mean_of(*found, offsets_s=np.zeros(len(rig.cameras))),
        start_covariance(process, _clock_sigmas(seen, rig, process), START_POSITION_M + moved_m, START_ATTITUDE_RAD),
        levels=start_levels(),
        noise=start_noise(len(rig.cameras), process.pixel_noise_px),
        manoeuvre_s=process.manoeuvre_s,
    )


def _posed(seen: Seen, rig: Rig, slack_m: float) -> tuple[Array, Array] | Rejected:
    """Return p_BinW (3,) and R_BtoW (3, 3) of the marker, if it is seen.

    slack_m: by how much a ball may seem off its place beyond what its spots' noise allows. Cameras with one trigger
        need little, and of a room full of the marker's colours little is then the marker; but a spot that has grown
        together with something, or a ball that moved between two pictures, needs more.
    """
    points = [_places(ball, seen, rig, slack_m) for ball in range(len(rig.marker))]
    chosen = associate(points, rig.marker, slack_m)
    if isinstance(chosen, Rejected):
        return chosen
    found = pose(np.stack([point.p_inW for point in chosen]), rig.marker)
    if isinstance(found, Rejected):
        return found
    p_BinW, R_BtoW = found
    places = rig.marker.points_inB @ R_BtoW.T + p_BinW
    for ball, point, place in zip(rig.marker.balls, chosen, places, strict=True):
        miss_m = float(np.linalg.norm(point.p_inW - place))
        if miss_m > slack_m + MISS_SIGMA * float(np.sqrt(np.trace(point.covariance))):
            detail = f"{ball.name} stands {miss_m * 1e3:.0f} mm from its place on the marker: mirrored or mistaken"
            return Rejected(Reason.GEOMETRY, detail)
    return found


def together(frames: Sequence[Frame]) -> bool:
    """Say whether frames come from one trigger."""
    times = [frame.t_ns for frame in frames]
    return max(times) - min(times) <= TOGETHER_NS


def _spot_error_m(rig: Rig) -> float:
    """Return how far off a ball's middle its spot may be, where its shaded side or a tube shows none of it [m]."""
    return SPOT_SHARE * max(ball.radius_m for ball in rig.marker.balls)


def _one_trigger(seen: Seen, rig: Rig) -> bool:
    """Say whether all the cameras' pictures show one instant, in every row."""
    readouts = any(rig.cameras[camera].readout_ns for camera in seen)
    return not readouts and together([frame for frame, _ in seen.values()])


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
    """Return where rays of one ball's colour from two cameras meet and the ball would look as large, best first."""
    found: list[Point] = []
    cameras = sorted(camera for camera, (_, blobs) in seen.items() if blobs[ball])
    pairs = list(combinations(cameras, 2))
    most = int(MAX_SPOTS / max(1.0, len(pairs)) ** 0.5)  # as many rays to compare, however many cameras there are
    rays = {camera: _rays(camera, ball, seen[camera][1][ball][:most], rig) for camera in cameras}
    for a, b in pairs:
        first, second = rig.cameras[a], rig.cameras[b]
        sigma = CENTROID_SIGMA_PX / min(first.focal_px, second.focal_px)
        found += meetings(rays[a], rays[b], np.stack((first.p_CinW, second.p_CinW)), sigma, slack_m, MAX_PLACES)
    return sorted(found, key=lambda point: point.miss_m)[:MAX_PLACES]


def _rays(camera: int, ball: int, blobs: Sequence[Blob], rig: Rig) -> Rays:
    """Return the bearings to blobs, and how far off a ball is that shows so much of its colour.

    Source: a ball of radius r at a distance d shows a disc of pi (f r / d)^2, and as much of its colour as a track
        takes for it too.
    """
    eye = rig.cameras[camera]
    uv_px, area_px = np.array([blob.uv_px for blob in blobs]), np.array([blob.area_px for blob in blobs])
    whole_m = eye.focal_px * rig.marker.balls[ball].radius_m * np.sqrt(np.pi / area_px)  # off, if all of it shows
    within_m = np.outer(whole_m, np.sqrt((LEAST_AREA_SHARE, MOST_AREA_SHARE)))
    return Rays(np.ascontiguousarray(eye.bearings(uv_px) @ eye.R_CtoW.T), within_m)
