"""The frames themselves in the log, within a budget of bytes: what a replay needs to see what the tracker saw."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import cv2
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

from bridge.log.scene import stamp
from tracker.types import Event, Frame, Rejected, Silence

MEGABYTE = 1_000_000
FILM_METADATA = "frames"
WAITING_FRAMES = 64  # two seconds of two cameras at 15 Hz, some 60 MB
_JPEG_START, _PNG_START = b"\xff\xd8", b"\x89PNG"


class FrameFormat(StrEnum):
    """How frames are kept: png loses nothing, jpeg takes a tenth of the room."""

    JPEG = "jpeg"
    PNG = "png"


class MarkKind(StrEnum):
    """What a mark between the frames stands for."""

    SILENCE = "silence"  # no frame came for a while
    REJECTED = "rejected"  # the source gave something up
    MISSED = "missed"  # a frame that is not in the log: the encoder was behind
    FULL = "full"  # the budget is used up: no frame from here on
    END = "end"  # the source ended


class Mark(NamedTuple):
    """Something between the frames: a replay must meet it where the flight did. t_ns: its own time, 0 for none [ns]."""

    kind: MarkKind
    t_ns: int = 0
    camera: int = -1
    reason: str = ""
    detail: str = ""


@dataclass(frozen=True, slots=True)
class FilmTerms:
    """How frames are kept. budget_bytes: of all of them together.  jpeg_quality: 1 to 100."""

    format: FrameFormat
    budget_bytes: int
    jpeg_quality: int = 95


@dataclass(frozen=True, slots=True)
class FilmState:
    """How it fares. stored, missed: frames in the log, and not.  size_bytes: of those stored.  full: budget used up."""

    stored: int
    missed: int
    size_bytes: int
    full: bool


class Film:
    """Choose which frames the log keeps, and turn them into image files.

    `admit` is for the loop's thread and takes no time; the rest is for the thread that writes.
    """

    def __init__(self, terms: FilmTerms) -> None:
        self._terms = terms
        self._ended = False  # by the loop's thread
        self._admitted = 0
        self._missed = 0
        self._done = 0  # the rest by the writing one
        self._stored = 0
        self._size_bytes = 0
        self._full = False

    def admit(self, event: Event | None, *, wait: bool) -> Frame | Mark | None:
        """Return what the log is to keep of an event, None once the budget is used up, or behind the end.

        event: None at the end of all events.  wait: whether the loop waits for the log, so that nothing is missed.
        """
        if self._full or self._ended:
            return None
        self._ended = event is None
        if not isinstance(event, Frame):
            return _mark(event)
        if not wait and self._admitted - self._done >= WAITING_FRAMES:
            self._missed += 1
            return Mark(MarkKind.MISSED, event.t_ns, event.camera)
        self._admitted += 1
        return event

    def develop(self, frame: Frame) -> bytes | None:
        """Return the frame as an image file, None if it does not fit into what is left of the budget.

        A frame that came as a file of that kind, or of any kind where nothing may be lost, is kept as that file: exact,
        and no larger than it was.
        """
        self._done += 1
        if self._full:
            return None
        data = frame.encoded if self._may_pass(frame.encoded) else self._encode(frame)
        if self._size_bytes + len(data) > self._terms.budget_bytes:
            self._full = True
            return None
        self._stored += 1
        self._size_bytes += len(data)
        return data

    def state(self) -> FilmState:
        """Say how it fares."""
        return FilmState(self._stored, self._missed, self._size_bytes, self._full)

    def trouble(self) -> str:
        """Return what the operator should know, "" for nothing."""
        if self._full:
            return f"frames ended after {self._stored}: their {self._terms.budget_bytes / MEGABYTE:g} MB are used up"
        if self._missed:
            return f"{self._missed} frames are not in the log: this computer is too slow to compress them"
        return ""

    def _may_pass(self, data: bytes) -> bool:
        exact = self._terms.format is FrameFormat.PNG
        return data.startswith((_JPEG_START, _PNG_START) if exact else _JPEG_START)

    def _encode(self, frame: Frame) -> bytes:
        if self._terms.format is FrameFormat.PNG:
            done, data = cv2.imencode(".png", frame.image)
        else:
            done, data = cv2.imencode(".jpg", frame.image, (cv2.IMWRITE_JPEG_QUALITY, self._terms.jpeg_quality))
        if not done:
            raise ValueError(f"an image of shape {frame.image.shape} cannot be compressed")
        return data.tobytes()


def image_message(data: bytes, t_ns: int, frame_id: str) -> bytes:
    """Return a foxglove.CompressedImage of an image file, stamped at mid-exposure [ns]."""
    kind = FrameFormat.JPEG if data.startswith(_JPEG_START) else FrameFormat.PNG
    message = CompressedImage(frame_id=frame_id, data=data, format=kind.value)
    stamp(message, t_ns)
    packed: bytes = message.SerializeToString()
    return packed


def mark_value(mark: Mark) -> dict[str, Any]:
    """Return the `/events` message of a mark."""
    return {**mark._asdict(), "kind": mark.kind.value}


def _mark(event: Silence | Rejected | None) -> Mark:
    if event is None:
        return Mark(MarkKind.END)
    if isinstance(event, Silence):
        return Mark(MarkKind.SILENCE, event.t_ns)
    camera = -1 if event.camera is None else event.camera
    return Mark(MarkKind.REJECTED, event.t_ns, camera, event.reason.value, event.detail)
