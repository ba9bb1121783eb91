"""Write the log: entries in, MCAP out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from io import BufferedWriter
from pathlib import PurePath
from typing import Any

from foxglove_schemas_protobuf.Log_pb2 import Log

from bridge.heard import NOTHING
from bridge.log import entry as values
from bridge.log import scene, topics, vehicle
from bridge.log.calibration import CALIBRATION_ATTACHMENT, calibration_json
from bridge.log.container import Container
from bridge.log.entry import Entry, encode
from bridge.log.film import Film, Mark, MarkKind, image_message, mark_value
from bridge.log.received import STATUSTEXT, HeardWriter, line_of
from bridge.wire import Sent
from tracker.camera import Camera
from tracker.rig import Marker
from tracker.types import Estimate, Frame, TrackState

_MEDIA_TYPES = {
    ".toml": "application/toml",
    ".json": "application/json",
    ".yaml": "application/yaml",
    ".txt": "text/plain",
}


@dataclass(frozen=True, slots=True)
class Cover:
    """What stands at the front of a log, readable however early the recorder was killed.

    attachments: whole files by name, such as the config as used.
    metadata: names and values by topic, such as versions, source URI and command line.
    made_ns: wall clock at the beginning [ns].
    """

    attachments: Mapping[str, bytes]
    metadata: Mapping[str, Mapping[str, str]]
    cameras: tuple[Camera, ...]
    marker: Marker
    made_ns: int


class LogWriter:
    """Write a log to a stream that it then owns. For one thread.

    film: makes image files of frames, None where the log keeps none.
    Raises:
        OSError: from every method, whatever the stream raises.
    """

    def __init__(self, stream: BufferedWriter, cover: Cover, film: Film | None = None) -> None:
        self._stream = stream
        self._film = film
        self._container = Container(stream)
        self._cover = cover
        self._channels: dict[str, int] = {}  # numbers by topic
        self._sent: dict[str, topics.Topic] = {}  # by MAVLink name
        self._state: TrackState | None = None
        self._reset_counter: int | None = None
        self._film_ended = False
        self._heard = HeardWriter(self._json, self._remark)
        self._begin()

    def write(self, entry: Entry) -> None:
        """Append one step."""
        if topics.CAMERA_TF.name not in self._channels:
            self._write_scene(entry.now_ns)
        now_ns = entry.now_ns
        if entry.wall_ns is not None:
            self._json(topics.CLOCK, {"stream_ns": now_ns, "wall_ns": entry.wall_ns}, now_ns, now_ns)
        if entry.film is not None and self._film is not None:
            self._write_film(entry.film, self._film, now_ns)
        if entry.frame is not None:
            value = values.sightings_value(entry.frame, entry.step.sightings, entry.step.refused)
            self._json(topics.SIGHTINGS, value, now_ns, entry.frame.t_ns)
        if entry.rejections:
            self._json(topics.REJECTIONS, values.rejections_value(entry.rejections), now_ns, now_ns)
        if entry.step.health is not None:
            self._json(topics.HEALTH, values.health_value(entry.step.health), now_ns, entry.step.health.t_ns)
        for estimate in entry.step.estimates:
            self._write_estimate(estimate, entry.sent, now_ns)
        for sent in entry.sent:
            self._write_sent(sent, now_ns)
        if entry.heard is not NOTHING:
            self._heard.write(entry.heard, now_ns)
        self._write_changes(entry)

    def warn(self, now_ns: int, message: str) -> None:
        """Leave a warning of the recorder's own in the log panel."""
        self._remark(now_ns, now_ns, Log.WARNING, "recorder", message)

    def flush(self) -> None:
        """Hand everything written so far to the kernel: from here a kill of this process loses none of it."""
        self._container.flush()

    def finish(self, metadata: Mapping[str, str]) -> None:
        """Write the last metadata, the index and the footer, and close the stream."""
        self._container.flush()
        self._container.add_metadata("recorder", metadata)
        self._container.finish()
        self._stream.close()

    def _begin(self) -> None:
        for name, entries in self._cover.metadata.items():
            self._container.add_metadata(name, entries)
        drawn = {CALIBRATION_ATTACHMENT: calibration_json(self._cover.cameras, self._cover.marker)}
        for name, data in (drawn | dict(self._cover.attachments)).items():
            media_type = _MEDIA_TYPES.get(PurePath(name).suffix, "application/octet-stream")
            self._container.add_attachment(self._cover.made_ns, name, media_type, data)
        self._container.flush()

    def _write_scene(self, now_ns: int) -> None:
        for topic in topics.FIXED:
            self._open(topic)
        self._protobuf(topics.CAMERA_TF, scene.camera_transforms(self._cover.cameras), now_ns, now_ns)
        self._protobuf(topics.MARKER, scene.marker_scene(self._cover.marker), now_ns, now_ns)
        for camera in self._cover.cameras:
            self._protobuf(topics.calibration_topic(camera.name), scene.calibration(camera), now_ns, now_ns)

    def _write_estimate(self, estimate: Estimate, sent: tuple[Sent, ...], now_ns: int) -> None:
        t_ns, q_BtoW = estimate.t_ns, values.quaternion(estimate)
        value = values.estimate_value(estimate, q_BtoW)
        p_BinW = value["p_BinW_m"]
        self._json(topics.ESTIMATE, value, now_ns, t_ns)
        pose, transform = vehicle.pose_and_transform(t_ns, p_BinW, q_BtoW)
        self._put(topics.POSE, pose, now_ns, t_ns)
        self._put(topics.VEHICLE_TF, transform, now_ns, t_ns)
        self._json(topics.LATENCY, values.latency_value(estimate, sent), now_ns, t_ns)
        if self._reset_counter is not None and estimate.reset_counter != self._reset_counter:
            message = f"the estimate jumped: reset_counter {self._reset_counter} -> {estimate.reset_counter}"
            self._remark(now_ns, t_ns, Log.WARNING, "tracker", message)
        self._reset_counter = estimate.reset_counter

    def _write_film(self, kept: Frame | Mark, film: Film, now_ns: int) -> None:
        """Append a frame's image, or the mark of what came in its place."""
        if isinstance(kept, Frame):
            camera = self._cover.cameras[kept.camera]
            data = film.develop(kept)
            if data is not None:
                image = image_message(data, kept.t_ns, scene.camera_frame(camera))
                self._put(topics.image_topic(camera.name), image, now_ns, kept.t_ns)
                return
            if self._film_ended:
                return
            self._film_ended = True
            self.warn(now_ns, film.trouble())
            kept = Mark(MarkKind.FULL)
        self._json(topics.EVENTS, mark_value(kept), now_ns, now_ns)

    def _write_sent(self, sent: Sent, now_ns: int) -> None:
        topic = self._sent.get(sent.message)
        if topic is None:
            topic = self._sent[sent.message] = topics.sent_topic(sent.message, sent.fields)
        self._put(topic, encode(values.sent_value(sent)), now_ns, sent.t_ns)
        if sent.message == STATUSTEXT:
            self._remark(now_ns, sent.t_ns, *line_of(sent.fields, f"to {sent.link}"))

    def _write_changes(self, entry: Entry) -> None:
        state = entry.step.state
        if state is not self._state:
            before = "" if self._state is None else f"{self._state.value} -> "
            level = Log.WARNING if state is TrackState.LOST else Log.INFO
            self._remark(entry.now_ns, entry.now_ns, level, "tracker", before + state.value)
            self._state = state

    def _remark(self, now_ns: int, t_ns: int, level: Log.Level.ValueType, name: str, message: str) -> None:
        self._protobuf(topics.LOG, scene.remark(t_ns, level, name, message), now_ns, t_ns)

    def _json(self, topic: topics.Topic, value: dict[str, Any], now_ns: int, t_ns: int) -> None:
        self._put(topic, encode(value), now_ns, t_ns)

    def _protobuf(self, topic: topics.Topic, message: Any, now_ns: int, t_ns: int) -> None:
        self._put(topic, message.SerializeToString(), now_ns, t_ns)

    def _put(self, topic: topics.Topic, data: bytes, now_ns: int, t_ns: int) -> None:
        """Append a message to a topic, which begins with its first one."""
        channel = self._channels.get(topic.name)
        if channel is None:
            channel = self._open(topic)
        self._container.add_message(channel, now_ns, t_ns, data)

    def _open(self, topic: topics.Topic) -> int:
        """Begin a topic and return its channel's number."""
        self._channels[topic.name] = self._container.add_channel(
            topic.name, topic.message_encoding, topic.schema_name, topic.schema_encoding, topic.schema
        )
        return self._channels[topic.name]
