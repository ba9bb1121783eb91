"""cv2.VideoCapture, opened for a file or for a live camera."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

import cv2
from cv2.typing import MatLike

from tracker.errors import OperatorError
from tracker.sources.devices import plugged_cameras

OPEN_TIMEOUT_MS = 3000
READ_TIMEOUT_MS = 1000
# Two V4L2 buffers: one is filled while the other is decoded. With one, a frame that starts during decoding is lost
# and the rate halves; with OpenCV's four, a slow reader gets frames that are three periods old.
V4L2_BUFFERS = 2
# OpenCV takes these from the environment only, when it first reads a stream. What the operator set there stands.
_ENVIRONMENT = {"OPENCV_FFMPEG_LOGLEVEL": "-8", "OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT": "3"}
# These it takes at each opening, and for files too, which would lose their first frames: set while a live stream is
# opened. Probing must not queue frames, and decoding must not wait for later ones.
_STREAM_OPTIONS_KEY = "OPENCV_FFMPEG_CAPTURE_OPTIONS"
_STREAM_OPTIONS = "rtsp_transport;tcp|fflags;nobuffer|flags;low_delay"
_LOG_LEVEL_SILENT = 0
_environment_lock = threading.Lock()


class Capture(Protocol):
    """What is used of cv2.VideoCapture."""

    def grab(self) -> bool:
        """Wait for the next frame."""

    def retrieve(self) -> tuple[bool, MatLike]:
        """Decode the frame that was grabbed."""

    def get(self, propId: int) -> float:
        """Return a property, 0 or -1 if there is none such."""

    def set(self, propId: int, value: float) -> bool:
        """Set a property; False if it was refused."""

    def getBackendName(self) -> str:
        """Return which of OpenCV's backends reads the stream, such as "V4L2"."""

    def release(self) -> None:
        """Close the stream."""


def open_file(path: str) -> cv2.VideoCapture:
    """Open a video file.

    Raises:
        OperatorError: OpenCV cannot open it.
    """
    quieten_opencv()
    capture = cv2.VideoCapture(path)
    if not capture.isOpened():
        raise OperatorError(f"video {path}: cannot be opened as a video; give a file that OpenCV can decode")
    return capture


def open_address(address: str, name: str, read_timeout_ms: int = READ_TIMEOUT_MS) -> cv2.VideoCapture:
    """Open a live camera.

    Args:
        address: a number (0 is /dev/video0), a device's path, an rtsp:// or http:// address, or a GStreamer pipeline
            (anything with " ! " in it; it must end in appsink).
        name: the camera's name in messages.
        read_timeout_ms: a network camera that gives no frame for so long counts as lost [ms].
    Raises:
        OperatorError: OpenCV cannot open it.
    """
    quieten_opencv()
    capture = _open(address, read_timeout_ms)
    if capture.isOpened():
        return capture
    raise OperatorError(f"camera {name}: {address!r} cannot be opened; {_remedy(address)}")


def quieten_opencv() -> None:
    """Keep OpenCV and FFmpeg from writing about failures that this program tells, once, in a line of its own.

    This holds for the whole process, and for FFmpeg only if nothing was read through it before.
    """
    for key, value in _ENVIRONMENT.items():
        os.environ.setdefault(key, value)
    if "OPENCV_LOG_LEVEL" not in os.environ:
        # OpenCV 5 moved it.
        set_level = getattr(cv2, "setLogLevel", None) or cv2.utils.logging.setLogLevel
        set_level(_LOG_LEVEL_SILENT)


@contextmanager
def _stream_options() -> Iterator[None]:
    """Open streams for low latency, unless the operator's environment says how to open them."""
    with _environment_lock:
        if _STREAM_OPTIONS_KEY in os.environ:
            yield
            return
        os.environ[_STREAM_OPTIONS_KEY] = _STREAM_OPTIONS
        try:
            yield
        finally:
            del os.environ[_STREAM_OPTIONS_KEY]


def is_pipeline(address: str) -> bool:
    """Say whether an address is a GStreamer pipeline."""
    return " ! " in address


def is_network(address: str) -> bool:
    """Say whether an address is one of a network stream."""
    return "://" in address and not is_pipeline(address)


def _open(address: str, read_timeout_ms: int) -> cv2.VideoCapture:
    if address.isdecimal() or address.startswith("/dev/"):
        # Only the V4L2 backend tells capture times and sets the controls; a build with GStreamer would prefer that.
        backend = cv2.CAP_V4L2 if cv2.videoio_registry.hasBackend(cv2.CAP_V4L2) else cv2.CAP_ANY
        return cv2.VideoCapture(int(address) if address.isdecimal() else address, backend)
    if is_pipeline(address):
        return cv2.VideoCapture(address, cv2.CAP_GSTREAMER)
    if is_network(address):
        # One decoding thread: with more, H.264 comes as many frames late as there are threads.
        timeouts = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, OPEN_TIMEOUT_MS, cv2.CAP_PROP_READ_TIMEOUT_MSEC, read_timeout_ms]
        with _stream_options():
            return cv2.VideoCapture(address, cv2.CAP_FFMPEG, [*timeouts, cv2.CAP_PROP_N_THREADS, 1])
    return cv2.VideoCapture(address)


def _remedy(address: str) -> str:
    if is_pipeline(address):
        if not cv2.videoio_registry.hasBackend(cv2.CAP_GSTREAMER):
            return "this OpenCV is built without GStreamer: install the distribution's python3-opencv"
        return "try the pipeline with gst-launch-1.0; it must end in appsink"
    if is_network(address):
        return f"nothing answered with video within {OPEN_TIMEOUT_MS / 1000:g} s: check cable, address and power"
    found = ", ".join(plugged_cameras()) or "none"
    return f"check that it is plugged in, used by no other program and readable by you (group video); found: {found}"
