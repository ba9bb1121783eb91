"""Gravity and heading from the vehicle itself, set down on three places of a level floor or table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tools.calibrate.room.scene import seen_at
from tools.calibrate.room.solve import Found
from tools.calibrate.room.start import marker_poses
from tracker.errors import OperatorError
from tracker.rig import Rig
from tracker.types import Array

STILL_M, LEAST_STILL_S, GAP_S = 0.002, 1.5, 0.5  # a hand sways further
ANOTHER_M = 0.1  # nearer stands are one and the same
LEAST_ACROSS_M = 0.15  # of the third spot from the line through the first two
LEAST_ALONG_M = 0.25
LEVEL_DEG = 20.0
HOW = (
    "let the vehicle stand still for 3 s on each of three places of a level floor or table, 0.5 m apart, the last aside"
)


@dataclass(frozen=True, slots=True, eq=False)
class Stand:
    """The vehicle stood still. from_s, to_s: when.  p_BinW (3,): where [m].  up_inW (3,): the marker's z."""

    from_s: float
    to_s: float
    p_BinW: Array
    up_inW: Array


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

    def tilt_deg(self, sigma_m: float) -> float:
        """Return one sigma of the floor's tilt, its spots being known to sigma_m."""
        return float(np.degrees(np.sqrt(2.0) * sigma_m / min(self.along_m, self.across_m)))

    def heading_deg(self, sigma_m: float) -> float:
        """Return one sigma of the x axis' heading, its spots being known to sigma_m."""
        return float(np.degrees(np.sqrt(2.0) * sigma_m / self.along_m))


def find_stands(found: Found, rig: Rig) -> list[Stand]:
    """Find where the vehicle stood still, in order of time; two stands at one place are one."""
    spans = [(track.t_s[0], track.t_s[-1], float(np.median(np.diff(track.t_s)))) for track in found.tracks]
    t_s = np.arange(min(a for a, _, _ in spans), max(b for _, b, _ in spans), min(p for _, _, p in spans))
    seen = seen_at(found.tracks, t_s, found.scene.offsets_s)
    p_BinW, R_BtoW = marker_poses(seen, found.cameras, found.scene.offsets_s, rig)
    known = np.isfinite(p_BinW).all(axis=1)
    stands: list[Stand] = []
    for first, last in _still(t_s[known], p_BinW[known]):
        now = slice(first, last)
        up = R_BtoW[known][now, :, 2].mean(axis=0)
        stand = Stand(
            float(t_s[known][first]), float(t_s[known][last - 1]), np.median(p_BinW[known][now], axis=0),
            up / np.linalg.norm(up),
        )  # fmt: skip
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


def _still(t_s: Array, p: Array) -> list[tuple[int, int]]:
    """Return the stretches, first to past last, in which a point (n, 3) stays where it is."""
    stretches, first = [], 0
    for k in range(1, len(t_s) + 1):
        if k < len(t_s) and t_s[k] - t_s[k - 1] < GAP_S and np.linalg.norm(p[k] - p[first:k].mean(axis=0)) < STILL_M:
            continue
        if t_s[k - 1] - t_s[first] >= LEAST_STILL_S:
            stretches.append((first, k))
        first = k
    return stretches
