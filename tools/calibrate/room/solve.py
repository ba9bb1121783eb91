"""Footage in, cameras out.

tracks of the balls -> pairs of cameras, joined -> bundle adjustment, twice: the clocks move the sightings
                    -> the same images again, by a tracker that knows the cameras by now -> bundle adjustment
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tools.calibrate.room.bundle import Adjusted, adjust
from tools.calibrate.room.footage import Footage, looked_again
from tools.calibrate.room.gauge import aligned
from tools.calibrate.room.jacobian import Layout
from tools.calibrate.room.scene import Seen, common_instants, seen_at
from tools.calibrate.room.start import first_scene, marker_way
from tools.calibrate.room.tracks import Track
from tracker.camera import Camera
from tracker.rig import Rig, make_rig
from tracker.tuning import Tuning
from tracker.types import Array

MOST_INSTANTS = 200
ROUNDS = 2  # of adjustment: the first finds the clocks, the second takes the sightings at the right instants


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What the footage told.

    cameras: in the frame of the cameras that were given, their clock offsets in them.
    adjusted: the last adjustment, in the same frame.  seen: what it went by.
    """

    cameras: tuple[Camera, ...]
    adjusted: Adjusted
    seen: Seen


def find_cameras(footage: Footage, rig: Rig, tuning: Tuning) -> Found:
    """Find where the cameras stand and by how much their clocks differ.

    Args:
        footage: of the marker waved through the room.
        rig: intrinsics and marker as they are; the cameras' poses say only which frame the result is to be in.
        tuning: the tracker's, for the second look.
    Raises:
        OperatorError: too few instants that two cameras share, or sightings that do not fit together.
    """
    seen = common_instants(footage.tracks, MOST_INSTANTS, np.zeros(len(rig.cameras)))
    scene, seen = first_scene(seen, rig)
    roughly = _adjusted(footage.tracks, seen.t_s, scene.cameras, scene.offsets_s, rig, rig.cameras)
    tracks = looked_again(footage, make_rig(roughly.cameras, rig.marker), tuning)
    none = np.zeros(len(rig.cameras))  # the tracker's stamps have the offsets found so far in them
    t_s = common_instants(tracks, MOST_INSTANTS, none).t_s
    return _adjusted(tracks, t_s, roughly.cameras, none, rig, roughly.cameras)


def _adjusted(
    tracks: Sequence[Track], t_s: Array, cameras: tuple[Camera, ...], offsets_s: Array, rig: Rig,
    stamped: tuple[Camera, ...],
) -> Found:  # fmt: skip
    """Adjust, and give cameras in the frame of the rig's. stamped: whose clock offsets are in the tracks' times."""
    for _ in range(ROUNDS):
        scene, seen = marker_way(seen_at(tracks, t_s, offsets_s), cameras, offsets_s, rig)
        result = adjust(scene, seen, Layout(len(cameras), len(rig.marker), len(seen.t_s)))
        cameras, offsets_s = result.scene.cameras, result.scene.offsets_s
    scene = aligned(result.scene, rig.cameras)
    offsets_ns = (round(x * 1e9) + camera.clock_offset_ns for x, camera in zip(offsets_s, stamped, strict=True))
    timed = tuple(replace(c, clock_offset_ns=ns) for c, ns in zip(scene.cameras, offsets_ns, strict=True))
    return Found(timed, replace(result, scene=replace(scene, cameras=timed)), seen)
