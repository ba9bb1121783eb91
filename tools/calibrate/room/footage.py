"""Footage of the waved marker, looked at without knowing where the cameras stand."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from tools.calibrate.room.balls import find_balls
from tools.calibrate.room.tracks import Track, track_of
from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.rig import Rig
from tracker.types import Array, Event, Frame, Image

AROUND_PX = 24  # kept around the balls, for the second look
PATIENCE_NS = 10_000_000_000
TELL_NS = 5_000_000_000


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
    """What was kept. start_ns: the first frame's stamp, from which the tracks' times count.  frames: of each camera.

    stills: whole pictures of the beginning, if asked for.
    """

    start_ns: int
    frames: tuple[int, ...]
    tracks: tuple[Track, ...]
    clips: tuple[Clip, ...]
    stills: tuple[Frame, ...] = ()


def _silent(_line: str) -> None:
    """Tell nobody."""


class Watcher:
    """Look for the marker in frames as they come, and keep what shows it."""

    def __init__(self, rig: Rig, stills: int = 0) -> None:
        self._rig = rig
        self._wanted = stills
        self._stills: list[Frame] = []
        self._found: list[list[tuple[float, Array]]] = [[] for _ in rig.cameras]
        self._frames = [0] * len(rig.cameras)
        self._clips: list[Clip] = []
        self._start_ns: int | None = None
        self._last_ns = 0
        self.elapsed_ns = 0

    @property
    def idle_ns(self) -> int:
        """Return for how long no camera has seen the marker [ns]."""
        return self.elapsed_ns - self._last_ns

    def take(self, event: Event) -> None:
        """Take one event of the source.

        Raises:
            OperatorError: a picture of another size than the calibration's.
        """
        if self._start_ns is None:
            self._start_ns = event.t_ns
        self.elapsed_ns = event.t_ns - self._start_ns
        if not isinstance(event, Frame):
            return
        camera = self._rig.cameras[event.camera]
        _check_size(event, camera)
        if sum(still.camera == event.camera for still in self._stills) < self._wanted:
            self._stills.append(event)
        self._frames[event.camera] += 1
        centres = find_balls(event, self._rig)
        if centres is not None:
            self._found[event.camera].append(((self.elapsed_ns + camera.clock_offset_ns) * 1e-9, centres))
            self._clips.append(_clip(event, centres))
            self._last_ns = self.elapsed_ns

    def progress(self) -> str:
        """Say how often each camera has seen the marker."""
        counts = zip(self._rig.cameras, self._found, self._frames, strict=True)
        seen = ", ".join(f"{camera.name} {len(found)} of {frames}" for camera, found, frames in counts)
        return f"{self.elapsed_ns / 1e9:.0f} s, pictures with the marker: {seen}"

    def footage(self) -> Footage:
        """Return what was kept."""
        tracks = tuple(track_of(each, len(self._rig.marker)) for each in self._found)
        return Footage(self._start_ns or 0, tuple(self._frames), tracks, tuple(self._clips), tuple(self._stills))


def watch(
    events: Iterable[Event], rig: Rig, longest_s: float, tell: Callable[[str], None] = _silent, stills: int = 0
) -> Footage:
    """Find the balls in all frames of a source, up to a length [s], or until none shows them for ten seconds.

    The clock offsets that the rig knows are in the tracks' times, not in the clips'. Ctrl-C ends it as its end would.

    Args:
        tell: is told every five seconds of the footage how often each camera has seen the marker.
        stills: how many whole pictures of each camera to keep from the beginning.
    Raises:
        OperatorError: a picture of another size than the calibration's.
    """
    watcher, told = Watcher(rig, stills), 0
    try:
        for event in events:
            watcher.take(event)
            if watcher.elapsed_ns // TELL_NS > told:
                told = watcher.elapsed_ns // TELL_NS
                tell(watcher.progress())
            if watcher.elapsed_ns > longest_s * 1e9 or watcher.idle_ns > PATIENCE_NS:
                break
    except KeyboardInterrupt:
        tell("ended by Ctrl-C")
    return watcher.footage()


def _check_size(frame: Frame, camera: Camera) -> None:
    height, width = frame.image.shape[:2]
    if (width, height) != (camera.width_px, camera.height_px):
        raise OperatorError(
            f"{camera.name}: picture of {width} x {height} px, its calibration is of {camera.width_px} x "
            f"{camera.height_px} px; set the camera up as it was calibrated, or name its lens by --cameras"
        )


def _clip(frame: Frame, centres: Array) -> Clip:
    left, top = (max(0, int(x) - AROUND_PX) for x in centres[:, :2].min(axis=0))
    right, bottom = (int(x) + AROUND_PX for x in centres[:, :2].max(axis=0))
    return Clip(frame.camera, frame.t_ns, centres, left, top, frame.image[top:bottom, left:right].copy())
