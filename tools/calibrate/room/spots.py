"""Gravity and heading from the vehicle itself, set down on three places of a level floor or table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tools.calibrate.room.start import poses_of, triangulated_from
from tools.calibrate.room.tracks import Track
from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.rig import Rig
from tracker.types import Array

STILL_PX, LEAST_STILL_S = 0.7, 1.5  # a hand sways further
MOST, NEARLY, LEAST_FRAMES = 0.7, 0.8, 5  # of the frames, of the time, and how many
ANOTHER_M = 0.1  # nearer stands are one and the same
LEAST_ACROSS_M = 0.15  # of the third spot from the line through the first two
LEAST_ALONG_M = 0.25
LEVEL_DEG = 20.0
HOW = (
    "let the vehicle stand still for 3 s on each of three places of a level floor or table, 0.5 m apart, the last aside"
)


Span = tuple[float, float]
"""From when to when [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Stand:
    """The vehicle stood still. from_s, to_s: when.  p_BinW (3,): where [m].  up_inW (3,): the marker's z.

    uv_px (cameras, balls, 2): where the balls were seen; NaN of cameras that did not see it stand.
    """

    from_s: float
    to_s: float
    p_BinW: Array
    up_inW: Array
    uv_px: Array


@dataclass(frozen=True, slots=True, eq=False)
class Floor:
    """Three stands, and the room's frame by them: x from the first to the second, z up from the plane of all three.

    R_WtoF (3, 3), p_WinF (3,): take the frame that the cameras were found in to it.
    along_m: from the first stand to the second.  across_m: of the third from their line.
    lean_deg: of the marker on the standing vehicle.
    """

    stands: tuple[Stand, Stand, Stand]
    R_WtoF: Array
    p_WinF: Array
    along_m: float
    across_m: float
    lean_deg: float


def find_stands(tracks: Sequence[Track], offsets_s: Array, cameras: tuple[Camera, ...], rig: Rig) -> list[Stand]:
    """Find where the vehicle stood still before two cameras or more, in order of time; two at one place are one.

    Args:
        tracks: each camera's sightings.  offsets_s (cameras,): how much later than its track says each saw [s].
        cameras: as found.
    """
    tracks = [_shifted(track, offset_s) for track, offset_s in zip(tracks, offsets_s.tolist(), strict=True)]
    still = [_still(track) for track in tracks]
    stands: list[Stand] = []
    for from_s, to_s in _together(still):
        stood = [_stood(track, spans, (from_s, to_s)) for track, spans in zip(tracks, still, strict=True)]
        stand = _stand(np.stack(stood), (from_s, to_s), cameras, rig)
        if stand is None:
            continue
        if stands and np.linalg.norm(stands[-1].p_BinW - stand.p_BinW) < ANOTHER_M:
            stands.pop()
        stands.append(stand)
    return stands


def floor_of(stands: Sequence[Stand], cameras_inW: Array, origin_m: Array) -> Floor:
    """Make the room's frame of the last three stands.

    Args:
        cameras_inW (cameras, 3): where the cameras hang.
        origin_m (3,): where in the room the marker's middle was on the first spot.
    Raises:
        OperatorError: fewer than three stands, in a line, not level, or a room that is mirrored.
    """
    if len(stands) < 3:
        raise OperatorError(
            f"calibrate room: the vehicle stood still in {len(stands)} places, three are needed for gravity and "
            f"heading: {HOW}; or give --frame config"
        )
    a, b, c = stands[-3:]
    along, aside = b.p_BinW - a.p_BinW, c.p_BinW - a.p_BinW
    along_m = float(np.linalg.norm(along))
    x_inW = along / along_m
    aside = aside - (aside @ x_inW) * x_inW
    across_m = float(np.linalg.norm(aside))
    if along_m < LEAST_ALONG_M or across_m < LEAST_ACROSS_M:
        raise OperatorError(
            f"calibrate room: the second spot lies {1e3 * along_m:.0f} mm from the first, the third "
            f"{1e3 * across_m:.0f} mm from their line; at least {1e3 * LEAST_ALONG_M:.0f} and "
            f"{1e3 * LEAST_ACROSS_M:.0f} mm tell a heading and a level: {HOW}"
        )
    up = np.sum([stand.up_inW for stand in (a, b, c)], axis=0)
    normal = np.cross(x_inW, aside / across_m)
    z_inW = normal if normal @ up > 0.0 else -normal
    lean_deg = float(np.degrees(np.arccos(np.clip(z_inW @ up / np.linalg.norm(up), -1.0, 1.0))))
    if lean_deg > LEVEL_DEG:
        raise OperatorError(
            f"calibrate room: on its three spots the marker leans {lean_deg:.0f} deg, at most {LEVEL_DEG:.0f} deg: the "
            f"spots are not one level, or it was not set down: {HOW}"
        )
    _refuse_mirror(z_inW, cameras_inW, a.p_BinW)
    R = np.vstack((x_inW, np.cross(z_inW, x_inW), z_inW))
    return Floor((a, b, c), R, origin_m - R @ a.p_BinW, along_m, across_m, lean_deg)


def _refuse_mirror(z_inW: Array, cameras_inW: Array, spot_inW: Array) -> None:
    """Refuse a room in which cameras would look at a standing vehicle from below."""
    below = int(((cameras_inW - spot_inW) @ z_inW < 0.0).sum())
    if 2 * below > len(cameras_inW):
        raise OperatorError(
            f"calibrate room: MIRRORED: by the order of its colours the marker stands upside down before {below} of "
            f"{len(cameras_inW)} cameras; two places in [[marker.balls]] are swapped, or the cameras' pictures are "
            "mirrored (switch off the driver's flip)"
        )


def _shifted(track: Track, offset_s: float) -> Track:
    """Return a track by camera 0's clock."""
    return replace(track, t_s=track.t_s + offset_s)


def _still(track: Track) -> list[Span]:
    """Return from when to when a camera saw the balls stay where they were, a few mistaken frames aside."""
    t_s, spans = track.t_s, list[Span]()
    for first, from_s in enumerate(t_s.tolist()):
        last = int(np.searchsorted(t_s, from_s + LEAST_STILL_S, side="right"))
        uv = track.uv_px[first:last]
        if t_s[last - 1] - from_s < NEARLY * LEAST_STILL_S or len(uv) < LEAST_FRAMES:
            continue
        away_px = np.median(np.linalg.norm(uv - np.median(uv, axis=0), axis=2), axis=1)
        if (away_px < STILL_PX).mean() < MOST:
            continue
        begun_s = spans.pop()[0] if spans and spans[-1][1] >= from_s else from_s
        spans.append((begun_s, float(t_s[last - 1])))
    return spans


def _together(spans: Sequence[Sequence[Span]]) -> list[Span]:
    """Return the times long enough in which two cameras or more see it stand."""
    every = [span for each in spans for span in each]
    edges = sorted([(from_s, 1) for from_s, _ in every] + [(to_s, -1) for _, to_s in every])
    stood: list[Span] = []
    count, since_s = 0, 0.0
    for at_s, change in edges:
        if count >= 2 and count + change < 2 and at_s - since_s >= NEARLY * LEAST_STILL_S:
            stood.append((since_s, at_s))
        if count < 2 <= count + change:
            since_s = at_s
        count += change
    return stood


def _stood(track: Track, spans: Sequence[Span], when: Span) -> Array:
    """Return where a camera saw the balls (balls, 2) while they stood; NaN if it saw them pass at best.

    Its own word counts: a camera that sees the vehicle come but not stand would put the spot beside its place.
    """
    nowhere = np.full(track.uv_px.shape[1:], np.nan)
    own = [(max(from_s, when[0]), min(to_s, when[1])) for from_s, to_s in spans]
    from_s, to_s = max(own, key=lambda span: span[1] - span[0], default=(0.0, 0.0))
    stood = (track.t_s >= from_s) & (track.t_s <= to_s)
    return np.median(track.uv_px[stood], axis=0) if to_s - from_s > LEAST_STILL_S / 2.0 and stood.any() else nowhere


def _stand(uv_px: Array, when: Span, cameras: tuple[Camera, ...], rig: Rig) -> Stand | None:
    """Return the stand of a time by what the cameras saw (cameras, balls, 2); None where that makes no marker."""
    p_BinW, R_BtoW = poses_of(triangulated_from(uv_px, cameras)[None], rig)
    return Stand(*when, p_BinW[0], R_BtoW[0, :, 2], uv_px) if np.isfinite(p_BinW).all() else None
