"""Footage in, cameras out.

tracks of the balls -> pairs of cameras, joined -> bundle adjustment, twice: the clocks move the sightings
                    -> the same images again, by who knows the cameras by now -> bundle adjustment
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tools.calibrate.room.bundle import Adjusted, adjust
from tools.calibrate.room.centres import looked_again
from tools.calibrate.room.footage import Footage
from tools.calibrate.room.gauge import aligned
from tools.calibrate.room.jacobian import Layout
from tools.calibrate.room.scene import Scene, Seen, common_instants, seen_at
from tools.calibrate.room.start import check_shared, first_scene, marker_way
from tools.calibrate.room.tracks import Track
from tracker.camera import Camera
from tracker.rig import Rig, make_rig
from tracker.types import Array

MOST_INSTANTS = 400
ROUNDS = 2  # of adjustment: the first finds the clocks, the second takes the sightings at the right instants
STRETCH_S, LEAST_STRETCHES = 2.0, 10  # how long, and how many at least
HELD_OUT = 5  # of every five stretches the last is held out, to judge by


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What the footage told.

    cameras: in the frame of the cameras that were given, their clock offsets in them.  scene: in the same frame.
    adjusted: the last adjustment, in a frame of its own, in which camera 0 was not moved.
    seen: what it went by.  held_out: what was kept from it.  tracks: of the whole footage, on the clocks of `seen`.
    """

    cameras: tuple[Camera, ...]
    scene: Scene
    adjusted: Adjusted
    seen: Seen
    held_out: Seen
    tracks: tuple[Track, ...]


def find_cameras(footage: Footage, rig: Rig, *, lenses: bool = False) -> Found:
    """Find where the cameras stand and by how much their clocks differ.

    Args:
        footage: of the marker waved through the room.
        rig: intrinsics and marker as they are; the cameras' poses say only which frame the result is to be in.
        lenses: refine focal lengths and centres too, within what a good calibration of lenses leaves open.
    Raises:
        OperatorError: too few instants that two cameras share, or sightings that do not fit together.
    """
    none = np.zeros(len(rig.cameras))
    seen = common_instants(footage.tracks, MOST_INSTANTS, none)
    scene, seen = first_scene(seen, rig)
    roughly = refined(footage.tracks, seen.t_s, scene, rig)
    tracks = looked_again(footage, make_rig(roughly.cameras, rig.marker))
    t_s = common_instants(tracks, MOST_INSTANTS, none).t_s
    known = replace(roughly.scene, cameras=roughly.cameras, offsets_s=none)  # the tracks have the clocks in them by now
    return refined(tracks, t_s, known, make_rig(roughly.cameras, rig.marker), lenses=lenses)


def refined(tracks: Sequence[Track], t_s: Array, guess: Scene, rig: Rig, *, lenses: bool = False) -> Found:
    """Adjust cameras and clocks to what was seen at some instants but the held out ones.

    Args:
        tracks: each camera's sightings, by its stamps and the clock offset that the rig has for it.
        t_s (m,): instants [s].
        guess: cameras and clocks that are about right; its marker's poses do not matter.
        rig: the marker, the frame of the result, and the clock offsets that are in the tracks.
        lenses: adjust focal lengths and centres too.
    Raises:
        OperatorError: a camera whose sightings do not make the marker together with another's.
    """
    kept, cameras, offsets_s = t_s[~is_held_out(t_s)], guess.cameras, guess.offsets_s
    for _ in range(ROUNDS):
        scene, seen = marker_way(seen_at(tracks, kept, offsets_s), cameras, offsets_s, rig)
        check_shared(seen, rig)
        result = adjust(scene, seen, Layout(len(cameras), len(rig.marker), len(seen.t_s), lenses))
        cameras, offsets_s = result.scene.cameras, result.scene.offsets_s
    scene = aligned(result.scene, rig.cameras)
    timed = tuple(
        replace(camera, clock_offset_ns=said.clock_offset_ns + round(offset_s * 1e9))
        for camera, said, offset_s in zip(scene.cameras, rig.cameras, offsets_s.tolist(), strict=True)
    )
    held_out = seen_at(tracks, t_s[is_held_out(t_s)], offsets_s)
    return Found(timed, scene, result, seen, held_out, tuple(tracks))


def is_held_out(t_s: Array) -> NDArray[np.bool_]:
    """Say which instants (m,) are not for the fit but to judge it by: whole stretches, whose errors go together."""
    if not len(t_s):
        return np.zeros(0, dtype=bool)
    since_s = t_s - t_s[0]
    stretch_s = min(STRETCH_S, max(float(since_s[-1]), 1e-9) / LEAST_STRETCHES)
    return np.asarray((since_s // stretch_s) % HELD_OUT == HELD_OUT - 1)
