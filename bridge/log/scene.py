"""The room as viewers draw it: cameras and marker, in Foxglove's messages."""

from __future__ import annotations

from typing import Any

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from bridge.log.topics import BODY, ROOM
from tracker.camera import Camera
from tracker.maths import so3
from tracker.rig import Marker

_PLUMB_BOB_LENGTH = 5
_NS = 10**9


def stamp(message: Any, t_ns: int) -> None:
    """Set a message's timestamp to stream time [ns]."""
    message.timestamp.seconds, message.timestamp.nanos = divmod(t_ns, _NS)


def camera_frame(camera: Camera) -> str:
    """Return a camera's frame id; the prefix keeps a camera named `body` apart from the body."""
    return f"camera/{camera.name}"


def calibration(camera: Camera) -> CameraCalibration:
    """Return a camera's intrinsics; its plumb_bob model takes k1 k2 p1 p2 k3, so four coefficients gain a zero."""
    coefficients = camera.distortion.tolist()
    coefficients += [0.0] * (_PLUMB_BOB_LENGTH - len(coefficients))
    fx, fy, cx, cy = camera.K[0, 0], camera.K[1, 1], camera.K[0, 2], camera.K[1, 2]
    return CameraCalibration(
        frame_id=camera_frame(camera),
        width=camera.width_px,
        height=camera.height_px,
        distortion_model="plumb_bob" if len(coefficients) == _PLUMB_BOB_LENGTH else "rational_polynomial",
        D=coefficients,
        K=camera.K.ravel().tolist(),
        R=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        P=[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    )


def camera_transforms(cameras: tuple[Camera, ...]) -> FrameTransforms:
    """Return room -> camera of every camera, stamped 0: a viewer takes them as valid from the beginning."""
    message = FrameTransforms()
    for camera in cameras:
        _set_transform(
            message.transforms.add(parent_frame_id=ROOM, child_frame_id=camera_frame(camera)),
            camera.p_CinW.tolist(),
            so3.quaternion(camera.R_CtoW).tolist(),
        )
    return message


def marker_scene(marker: Marker) -> SceneUpdate:
    """Return the marker's balls, locked to the body's frame."""
    message = SceneUpdate()
    entity = message.entities.add(id="marker", frame_id=BODY, frame_locked=True)
    for ball in marker.balls:
        sphere = entity.spheres.add()
        position, size, colour = sphere.pose.position, sphere.size, sphere.color
        position.x, position.y, position.z = ball.p_inB.tolist()
        sphere.pose.orientation.w = 1.0
        size.x = size.y = size.z = 2.0 * ball.radius_m
        colour.b, colour.g, colour.r = (channel / 255.0 for channel in ball.colour.bgr)
        colour.a = 1.0
    return message


def remark(t_ns: int, level: Log.Level.ValueType, name: str, message: str) -> Log:
    """Return a line for the viewer's log panel."""
    line = Log(level=level, name=name, message=message)
    stamp(line, t_ns)
    return line


def _set_transform(message: FrameTransform, translation: list[float], q: list[float]) -> None:
    at, turn = message.translation, message.rotation
    at.x, at.y, at.z = translation
    turn.w, turn.x, turn.y, turn.z = q
