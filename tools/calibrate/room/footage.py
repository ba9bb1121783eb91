"""Footage of the waved marker, looked at without knowing where the cameras stand."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tools.calibrate.room.balls import find_balls
from tools.calibrate.room.tracks import Track, track_of
from tracker.rig import Rig
from tracker.types import Array, Event, Frame, Image

AROUND_PX = 24  # kept around the balls, for the second look
PATIENCE_NS = 10_000_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Clip:
    """The part of an image with the balls in it. t_ns: the camera's stamp.  left, top: where it was [px].

    centres_px (balls, 3): where the first look found the balls in the whole image, u, v, one sigma [px].
    """

    camera: int
    t_ns: int
    centres_px: Array
    left: int
    top: int
    image: Image

    def frame(self, width_px: int, height_px: int) -> Frame:
        """Return an image that is grey elsewhere."""
        whole = np.full((height_px, width_px, 3), 128, dtype=np.uint8)
        height, width = self.image.shape[:2]
        whole[self.top : self.top + height, self.left : self.left + width] = self.image
        whole.flags.writeable = False
        return Frame(self.camera, self.t_ns, whole)


@dataclass(frozen=True, slots=True, eq=False)
class Footage:
    """What was kept. start_ns: the first frame's stamp, from which the tracks' times count.  frames: of each camera."""

    start_ns: int
    frames: tuple[int, ...]
    tracks: tuple[Track, ...]
    clips: tuple[Clip, ...]


def watch(events: Iterable[Event], rig: Rig, longest_s: float) -> Footage:
    """Find the balls in all frames of a source, up to a length [s], or until a live one shows none for ten seconds.

    The clock offsets that the rig knows are in the tracks' times, not in the clips'.
    """
    found: list[list[tuple[float, Array]]] = [[] for _ in rig.cameras]
    frames, clips = [0] * len(rig.cameras), []
    start_ns, last_ns = None, 0
    for event in events:
        if start_ns is None:
            start_ns = last_ns = event.t_ns
        if isinstance(event, Frame):
            camera = rig.cameras[event.camera]
            frames[event.camera] += 1
            sized = event.image.shape[1::-1] == (camera.width_px, camera.height_px)
            centres = find_balls(event, rig) if sized else None
            if centres is not None:
                found[event.camera].append(((event.t_ns + camera.clock_offset_ns - start_ns) * 1e-9, centres))
                clips.append(_clip(event, centres))
                last_ns = event.t_ns
        if event.t_ns - start_ns > longest_s * 1e9 or event.t_ns - last_ns > PATIENCE_NS:
            break
    tracks = tuple(track_of(each, len(rig.marker)) for each in found)
    return Footage(start_ns or 0, tuple(frames), tracks, tuple(clips))


def _clip(frame: Frame, centres: Array) -> Clip:
    left, top = (max(0, int(x) - AROUND_PX) for x in centres[:, :2].min(axis=0))
    right, bottom = (int(x) + AROUND_PX for x in centres[:, :2].max(axis=0))
    return Clip(frame.camera, frame.t_ns, centres, left, top, frame.image[top:bottom, left:right].copy())
