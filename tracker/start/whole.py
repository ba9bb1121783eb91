"""Whole frames in which the marker is looked for: what in them may be a ball."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from tracker.camera import Camera
from tracker.image.behind import Room
from tracker.image.detect import Blob
from tracker.image.look import look_everywhere
from tracker.image.tint import Gains
from tracker.rig import Rig
from tracker.start.acquire import Seen
from tracker.types import Frame


@dataclass(frozen=True, eq=False)
class Whole:
    """A frame and, for each ball of the marker, the blobs of its colour in it.

    bare: without the known room; all where nothing is known of it.  room_known: whether something is.
    """

    frame: Frame
    camera: Camera
    rig: Rig
    gains: Gains
    bare: list[list[Blob]]
    room_known: bool

    @cached_property
    def everything(self) -> list[list[Blob]]:
        """Return the blobs with the room, looked for when they are first asked for."""
        return look_everywhere(self.frame, self.camera, self.rig, self.gains) if self.room_known else self.bare


def look_through(frame: Frame, camera: Camera, rig: Rig, gains: Gains, room: Room) -> Whole:
    """Look for the balls' colours in a whole frame, under a light, without what is known to stand behind."""
    return Whole(frame, camera, rig, gains, look_everywhere(frame, camera, rig, gains, room), room.looks.size > 0)


def to_start_on(whole: Sequence[Whole]) -> Iterator[Seen]:
    """Yield what a track may start on, in the order to try: without the known room, then all there is, if more."""
    yield {one.frame.camera: (one.frame, one.bare) for one in whole}
    if any(_areas(one.bare) != _areas(one.everything) for one in whole):
        yield {one.frame.camera: (one.frame, one.everything) for one in whole}


def _areas(blobs: Sequence[Sequence[Blob]]) -> list[list[float]]:
    return [[blob.area_px for blob in of_a_ball] for of_a_ball in blobs]
