"""The log's topics: names, encodings and schemas.

JSON schemas stay within what Foxglove reads: one type a field, every object with its properties, so no field may be
"number or null" and no object may have keys that are only known at run time. A number that is not finite is null.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap_protobuf.schema import build_file_descriptor_set

from bridge.wire import FieldValue

Schema = dict[str, Any]

ROOM, BODY = "room", "body"  # frame ids; a camera's is `camera/<name>`
SENT_PREFIX = "/mavlink/sent/"
CALIBRATION_PREFIX = "/calibration/"
CAMERA_PREFIX = "/camera/"


@dataclass(frozen=True, slots=True)
class Topic:
    """One topic: its name, how its messages are encoded, and the schema that viewers read them by."""

    name: str
    message_encoding: str
    schema_name: str
    schema_encoding: str
    schema: bytes


def integer(description: str) -> Schema:
    """Describe a whole number."""
    return {"type": "integer", "description": description}


def number(description: str) -> Schema:
    """Describe a real number; null stands for one that is not finite."""
    return {"type": "number", "description": description}


def numbers(description: str, length: int | None = None) -> Schema:
    """Describe a list of real numbers, of a fixed length if one is given."""
    bounds = {} if length is None else {"minItems": length, "maxItems": length}
    return {"type": "array", "items": {"type": "number"}, "description": description, **bounds}


def text(description: str) -> Schema:
    """Describe a string."""
    return {"type": "string", "description": description}


def each(description: str, **properties: Schema) -> Schema:
    """Describe a list of objects with these properties."""
    return {"type": "array", "items": {"type": "object", "properties": properties}, "description": description}


def json_topic(name: str, schema_name: str, **properties: Schema) -> Topic:
    """Make a topic of JSON objects with these properties."""
    schema = {"type": "object", "title": schema_name, "properties": properties}
    return Topic(name, MessageEncoding.JSON, schema_name, SchemaEncoding.JSONSchema, json.dumps(schema).encode())


def protobuf_topic(name: str, message: Any) -> Topic:
    """Make a topic of the protobuf messages of a generated class."""
    descriptors = build_file_descriptor_set(message).SerializeToString()
    return Topic(
        name, MessageEncoding.Protobuf, message.DESCRIPTOR.full_name, SchemaEncoding.Protobuf, bytes(descriptors)
    )


def calibration_topic(camera: str) -> Topic:
    """Make the topic of one camera's intrinsics."""
    return protobuf_topic(CALIBRATION_PREFIX + camera, CameraCalibration)


@cache
def image_topic(camera: str) -> Topic:
    """Make the topic of one camera's frames."""
    return protobuf_topic(CAMERA_PREFIX + camera, CompressedImage)


def sent_topic(message: str, fields: Mapping[str, FieldValue]) -> Topic:
    """Make the topic of one MAVLink message, its schema drawn from the first one's fields, so viewers can plot them."""
    return json_topic(
        SENT_PREFIX + message,
        f"posebridge.sent.{message}",
        link=text("URI of the link it left by"),
        t_ns=integer("stream time it speaks of [ns]"),
        sent_ns=integer("stopwatch reading after the kernel took it [ns]"),
        available_ns=integer("stopwatch reading when the newest frame behind it stood in memory, 0 for none [ns]"),
        latency_ns=integer("sent_ns - available_ns; -1 where no frame is behind it [ns]"),
        raw={"type": "string", "contentEncoding": "base64", "description": "the whole MAVLink 2 frame"},
        fields=fields_schema(fields),
    )


def fields_schema(fields: Mapping[str, FieldValue]) -> Schema:
    """Describe a MAVLink message's fields by those of one such message."""
    return {"type": "object", "properties": {name: _field(value) for name, value in fields.items()}}


def _field(value: FieldValue) -> Schema:
    if isinstance(value, str):
        return text("MAVLink field")
    return numbers("MAVLink field") if isinstance(value, list) else number("MAVLink field")


POSE = protobuf_topic("/pose", PoseInFrame)
VEHICLE_TF = protobuf_topic("/tf", FrameTransform)
CAMERA_TF = protobuf_topic("/tf/cameras", FrameTransforms)
MARKER = protobuf_topic("/marker", SceneUpdate)
LOG = protobuf_topic("/log", Log)

ESTIMATE = json_topic(
    "/estimate",
    "posebridge.Estimate",
    t_ns=integer("stream time the state holds for: mid-exposure of the newest frame of its round [ns]"),
    state=text("searching, tracking or lost"),
    reset_counter=integer("grows by one, modulo 256, each time the estimate really jumps"),
    p_BinW_m=numbers("position of the body in the room: x, y, z [m]", 3),
    q_BtoW=numbers("attitude, Hamilton quaternion: w, x, y, z", 4),
    v_BinW_m_s=numbers("velocity in the room [m/s]", 3),
    w_BinB_rad_s=numbers("angular rate against the room, in the body [rad/s]", 3),
    covariance=numbers("upper triangle, row by row, of the 12 x 12: position, attitude, velocity, rate", 78),
    nis=number("normalised innovation squared of the last update"),
    nis_dof=integer("its degrees of freedom, 0 for no update"),
    available_ns=integer("stopwatch reading when that frame stood in memory [ns]"),
    p_3sigma_m=numbers("three standard deviations of the position, for plots: x, y, z in the room [m]", 3),
    clock_offsets_ms=numbers("how much later than its stamp each camera but the first saw, by the first's clock [ms]"),
    clock_sigmas_ms=numbers("one sigma of each of these [ms]"),
)
LATENCY = json_topic(
    "/latency",
    "posebridge.Latency",
    t_ns=integer("stream time of the estimate [ns]"),
    stages=each(
        "tracker stages",
        name=text("stage"),
        duration_ns=integer("stopwatch time it took [ns]"),
        duration_ms=number("the same, for plots [ms]"),
    ),
    links=each(
        "links the estimate went out by",
        link=text("URI"),
        latency_ns=integer("from frame available to its last message handed to the kernel [ns]"),
        latency_ms=number("the same, for plots [ms]"),
    ),
)
SIGHTINGS = json_topic(
    "/sightings",
    "posebridge.Sightings",
    camera=integer("index of the camera whose frame this was"),
    t_ns=integer("mid-exposure of the frame, stream time [ns]"),
    available_ns=integer("stopwatch reading when the image stood in memory [ns]"),
    sightings=each(
        "balls seen, and whether the estimate went by them",
        used={"type": "boolean", "description": "false: it did not fit"},
        camera=integer("index of the camera"),
        ball=integer("index of the marker's ball"),
        t_ns=integer("mid-exposure, stream time [ns]"),
        u_px=number("column of the centre in the distorted image [px]"),
        v_px=number("row of the centre in the distorted image [px]"),
        cov_px2=numbers("covariance: uu, uv, vv [px^2]", 3),
    ),
)
REJECTIONS = json_topic(
    "/rejections",
    "posebridge.Rejections",
    rejections=each(
        "what was left out of one step",
        reason=text("why: the keys of the summary's rejected counts"),
        detail=text("in words"),
        t_ns=integer("stream time, 0 if unknown [ns]"),
        camera=integer("index of the camera, -1 for none"),
    ),
)
HEALTH = json_topic(
    "/health",
    "posebridge.Health",
    t_ns=integer("when it was judged, stream time [ns]"),
    at_odds={"type": "boolean", "description": "some camera has moved, and nothing tells which"},
    epipolar_px=number("by how much rays to the balls miss each other, rms [px]"),
    spacing_mm=number("how far the balls stand from their distances on the marker, rms [mm]"),
    from_start={"type": "boolean", "description": "rays say that a camera does not stand where the room file has it"},
    cameras=each(
        "in their order",
        name=text("the camera's"),
        moved={"type": "boolean", "description": "it no longer stands where it stood when the flight began"},
        witness=text("what the room tells of it: learning, still, moved or blind"),
        shift_px=number("how far the room has moved in its picture, at the corner where that is most [px]"),
        at_vehicle_mm=number("what that shift is at the vehicle's distance [mm]"),
        full_share=number("share of its balls' pixels that are too bright for it, 0..1"),
    ),
)
CLOCK = json_topic(
    "/clock",
    "posebridge.Clock",
    stream_ns=integer("stream time [ns]"),
    wall_ns=integer("wall clock at the same instant, since 1970-01-01 UTC [ns]"),
)
EVENTS = json_topic(
    "/events",
    "posebridge.Event",
    kind=text("silence, rejected, missed, full or end: what stands between the frames, for a replay"),
    t_ns=integer("its own stream time, 0 for none [ns]"),
    camera=integer("index of the camera, -1 for none"),
    reason=text("why the source gave something up, else empty"),
    detail=text("in words"),
)

FIXED = (POSE, VEHICLE_TF, CAMERA_TF, MARKER, LOG, ESTIMATE, LATENCY, SIGHTINGS, REJECTIONS, HEALTH, CLOCK)
