"""A log with frames in it, as a source of frames: what the tracker saw, when the loop took it, in the same order.

What the flight's links received can come in again, too: time sync, origin, profile and streams are then those of it.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from bridge.links import Deliver, on_paper
from bridge.log import topics
from bridge.log.calibration import CALIBRATION_ATTACHMENT, cameras_of
from bridge.log.film import FILM_METADATA, MarkKind
from bridge.log.reader import LogReader, Record
from bridge.log.received import RECEIVED_PREFIX
from tracker.errors import OperatorError
from tracker.sources.image import decode_image
from tracker.sources.protocol import ClosesOnExit, Stopwatch
from tracker.types import Event, Frame, Reason, Rejected, Silence

_REASONS = {reason.value: reason for reason in Reason}


class LogSource(ClosesOnExit):
    """Give a log's frames as its flight had them, silences and what its source rejected too.

    now_ns: stream time at which the flight's loop took the newest event, or a message came in [ns].
    missing: frames that the flight had and the log has not.
    """

    def __init__(self, path: Path, stopwatch: Stopwatch) -> None:
        """Read the calibration; no frame yet.

        Raises:
            OperatorError: no log, no calibration in it, or it was recorded without frames.
        """
        self._reader = LogReader(path)
        self._stopwatch = stopwatch
        self._path = path
        self._closed = False
        self._inlets: Mapping[str, Deliver] = {}
        self._seen = self._given = 0
        self.now_ns = 0
        self.missing = 0
        attached = self._reader.attachments().get(CALIBRATION_ATTACHMENT)
        if attached is None:
            raise OperatorError(f"log {path}: holds no calibration; its front is damaged, and it cannot be replayed")
        self.cameras = cameras_of(attached, f"log {path}")
        self.camera_count = len(self.cameras)
        if FILM_METADATA not in self._reader.metadata():
            raise OperatorError(f"log {path}: holds no frames; record one with `run --log FILE --log-frames png`")
        self._indices = {topics.CAMERA_PREFIX + camera.name: index for index, camera in enumerate(self.cameras)}

    def deliver_to(self, inlets: Mapping[str, Deliver]) -> None:
        """Let what the flight's links received come in again: before the turn that took it, at the time it came.

        inlets: of the links that stand for the flight's own, by their URIs on paper.
        """
        self._inlets = inlets

    def __iter__(self) -> Iterator[Event]:
        """Yield the events in the order the flight took them.

        A turn's event is written before what the turn heard, so each is given once the next one is met.
        """
        waiting: Record | None = None
        for record in self._reader.records(_Wanted(self._indices)):
            if self._closed:
                return
            if record.topic.startswith(RECEIVED_PREFIX):
                self._deliver(record)
            elif record.topic == topics.SIGHTINGS.name:
                self._seen += 1
            else:
                yield from self._turn(waiting)
                waiting = record
                if record.topic == topics.EVENTS.name and record.value["kind"] == MarkKind.FULL:
                    self._inlets = {}  # from here on no turn is told from the next
        yield from self._turn(waiting)

    @property
    def troubles(self) -> tuple[str, ...]:
        """Return what the operator should know of the log once it was read, a line each."""
        missing = (
            f"{self.missing} frames of its flight are not in it: from the first of them on a replay differs"
            if self.missing
            else ""
        )
        return tuple(f"log {self._path}: {line}" for line in (*self._reader.lost, missing) if line)

    def close(self) -> None:
        """End the iteration."""
        self._closed = True

    def _turn(self, record: Record | None) -> Iterator[Event]:
        """Yield the event that a turn of the flight's loop took, none where it is not in the log."""
        if record is None:
            return
        self.now_ns = record.log_ns
        camera = self._indices.get(record.topic)
        event = _event(record.value) if camera is None else self._image(record, camera)
        self._given += isinstance(event, Frame)
        self.missing = self._seen - self._given
        if event is not None:
            yield event

    def _deliver(self, record: Record) -> None:
        """Let a message come in on the link that stands for its own."""
        deliver = self._inlets.get(on_paper(record.value["link"]))
        if deliver is not None:
            self.now_ns = record.value["arrived_ns"]
            deliver(base64.b64decode(record.value["raw"]))

    def _image(self, record: Record, camera: int) -> Event:
        data, t_ns = bytes(record.value.data), record.publish_ns
        image = decode_image(data)
        available_ns = self._stopwatch()
        if image is None:
            return Rejected(Reason.UNDECODABLE, f"{record.topic} of {self._path}: no whole image", t_ns, camera)
        return Frame(camera, t_ns, image, available_ns, data)


class _Wanted:
    """The topics that a replay reads: frames, what stood between them, and what came in."""

    def __init__(self, cameras: Mapping[str, int]) -> None:
        self._names = {*cameras, topics.EVENTS.name, topics.SIGHTINGS.name}

    def __contains__(self, topic: object) -> bool:
        return topic in self._names or (isinstance(topic, str) and topic.startswith(RECEIVED_PREFIX))


def _event(value: dict[str, Any]) -> Event | None:
    """Return the event that a mark stands for; a frame that is missing is none, and neither is the end."""
    if value["kind"] == MarkKind.SILENCE:
        return Silence(value["t_ns"])
    if value["kind"] == MarkKind.REJECTED and value["reason"] in _REASONS:
        camera = None if value["camera"] < 0 else value["camera"]
        return Rejected(_REASONS[value["reason"]], value["detail"], value["t_ns"], camera)
    return None
