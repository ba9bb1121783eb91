"""Whole frames in which the marker is looked for: what in them may be a ball."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from tracker.camera import Camera
from tracker.image.behind import Room
from tracker.image.detect import Blob
from tracker.image.look import look_everywhere
from tracker.image.tint import Gains
from tracker.rig import Rig
from tracker.start.acquire import Seen
from tracker.types import Frame


class Whole(NamedTuple):
    """A frame and, for each ball of the marker, the blobs of its colour in it.

    bare: without the known room.  everything: with it; the same where the room is not known or shows no such colour.
    """

    frame: Frame
    bare: list[list[Blob]]
    everything: list[list[Blob]]


def look_through(frame: Frame, camera: Camera, rig: Rig, gains: Gains, room: Room) -> Whole:
    """Look for the balls' colours in a whole frame, under a light, with and without what is known to stand behind."""
    everything = look_everywhere(frame, camera, rig, gains)
    return Whole(frame, look_everywhere(frame, camera, rig, gains, room) if room.looks.size else everything, everything)


def to_start_on(whole: Sequence[Whole]) -> list[Seen]:
    """Return what a track may start on, in the order to try: without the known room, then all there is, if more."""
    bare = {one.frame.camera: (one.frame, one.bare) for one in whole}
    everything = {one.frame.camera: (one.frame, one.everything) for one in whole}
    differs = any(_areas(one.bare) != _areas(one.everything) for one in whole)
    return [bare, everything] if differs else [everything]


def _areas(blobs: Sequence[Sequence[Blob]]) -> list[list[float]]:
    return [[blob.area_px for blob in of_a_ball] for of_a_ball in blobs]
