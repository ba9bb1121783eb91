"""A log with frames in it, as a source of frames: what the tracker saw, when the loop took it, in the same order."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from bridge.log import topics
from bridge.log.calibration import CALIBRATION_ATTACHMENT, cameras_of
from bridge.log.film import FILM_METADATA, MarkKind
from bridge.log.reader import LogReader, Record
from tracker.errors import OperatorError
from tracker.sources.image import decode_image
from tracker.sources.protocol import ClosesOnExit, Stopwatch
from tracker.types import Event, Frame, Reason, Rejected, Silence

_REASONS = {reason.value: reason for reason in Reason}


class LogSource(ClosesOnExit):
    """Give a log's frames as its flight had them, silences and what its source rejected too.

    now_ns: stream time at which the flight's loop took the newest event [ns].
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
        self.now_ns = 0
        self.missing = 0
        attached = self._reader.attachments().get(CALIBRATION_ATTACHMENT)
        if attached is None:
            raise OperatorError(f"log {path}: holds no calibration; its front is damaged, and it cannot be replayed")
        self.cameras = cameras_of(attached, f"log {path}")
        self.camera_count = len(self.cameras)
        if FILM_METADATA not in self._reader.metadata():
            raise OperatorError(f"log {path}: holds no frames; record one with `run --log FILE --log-frames png`")

    def __iter__(self) -> Iterator[Event]:
        """Yield the events in the order the flight took them."""
        cameras = {topics.CAMERA_PREFIX + camera.name: index for index, camera in enumerate(self.cameras)}
        seen = given = 0
        for record in self._reader.records({*cameras, topics.EVENTS.name, topics.SIGHTINGS.name}):
            if self._closed:
                return
            if record.topic == topics.SIGHTINGS.name:
                seen += 1
                self.missing = seen - given
                continue
            self.now_ns = record.log_ns
            event = self._image(record, cameras[record.topic]) if record.topic in cameras else _event(record.value)
            given += isinstance(event, Frame)
            if event is not None:
                yield event

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

    def _image(self, record: Record, camera: int) -> Event:
        data, t_ns = bytes(record.value.data), record.publish_ns
        image = decode_image(data)
        available_ns = self._stopwatch()
        if image is None:
            return Rejected(Reason.UNDECODABLE, f"{record.topic} of {self._path}: no whole image", t_ns, camera)
        return Frame(camera, t_ns, image, available_ns, data)


def _event(value: dict[str, Any]) -> Event | None:
    """Return the event that a mark stands for; a frame that is missing is none, and neither is the end."""
    if value["kind"] == MarkKind.SILENCE:
        return Silence(value["t_ns"])
    if value["kind"] == MarkKind.REJECTED and value["reason"] in _REASONS:
        camera = None if value["camera"] < 0 else value["camera"]
        return Rejected(_REASONS[value["reason"]], value["detail"], value["t_ns"], camera)
    return None
