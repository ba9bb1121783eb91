"""An MJPEG-over-HTTP camera, as network cameras are, that sends a frame when a test says so."""

from __future__ import annotations

import socket
import threading
from collections.abc import Sequence
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import TracebackType
from typing import Self

import cv2
import numpy as np
from cv2.typing import MatLike

from tracker.types import Image

BOUNDARY = b"frame"


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self, port: int, camera: MjpegCamera) -> None:
        super().__init__(("127.0.0.1", port), _Handler)
        self.camera = camera


class _Handler(BaseHTTPRequestHandler):
    server: _Server

    def log_message(self, format: str, *args: object) -> None:
        """Keep quiet."""

    def do_GET(self) -> None:
        """Stream until the viewer leaves or the camera dies."""
        self.server.camera.stream(self.connection)


class MjpegCamera:
    """Serve images 0, 1, ... on loopback, each once it is released; image 0 is from the start.

    Whoever connects gets the newest image at once and twice: one is used up in finding out what the stream holds.
    """

    def __init__(self, jpegs: Sequence[bytes]) -> None:
        self._jpegs = jpegs
        self._changed = threading.Condition()
        self._released = 0
        self._connections: list[socket.socket] = []
        self._port = 0
        self._images = [decoded(jpeg).astype(int) for jpeg in jpegs]
        self.start()

    @property
    def address(self) -> str:
        """Return the http address."""
        return f"http://127.0.0.1:{self._port}/"

    def start(self) -> None:
        """Listen, at the same port as before."""
        self._alive = True
        self._server = _Server(self._port, self)
        self._port = self._server.server_port
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
        self._thread.start()

    def kill(self) -> None:
        """Stop listening and cut every connection, as a camera does whose plug is pulled."""
        if not self._alive:
            return
        self._alive = False
        with self._changed:
            for connection in self._connections:
                with suppress(OSError):  # the viewer left before
                    connection.shutdown(socket.SHUT_RDWR)
            self._connections.clear()
            self._changed.notify_all()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def release(self, count: int = 1) -> None:
        """Let the next images go."""
        with self._changed:
            self._released += count
            self._changed.notify_all()

    def stream(self, connection: socket.socket) -> None:
        """Send images to one viewer as they are released."""
        head = b"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=" + BOUNDARY + b"\r\n\r\n"
        with self._changed:
            self._connections.append(connection)
            number = self._released
        try:
            connection.sendall(head + 2 * self._part(number))
            while self._is_released(number + 1, connection):
                number += 1
                connection.sendall(self._part(number))
        except OSError:
            return  # the viewer left, or the camera was killed

    def which(self, image: Image) -> int:
        """Return the number of the image this one shows; its decoder differs from ours by a few grey levels."""
        return int(np.argmin([np.abs(known - image).mean() for known in self._images]))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.kill()

    def _is_released(self, number: int, connection: socket.socket) -> bool:
        """Wait for an image to be released; False if the camera was killed meanwhile."""
        with self._changed:
            self._changed.wait_for(lambda: number <= self._released or connection not in self._connections)
            return connection in self._connections

    def _part(self, number: int) -> bytes:
        jpeg = self._jpegs[number % len(self._jpegs)]
        head = b"--%s\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % (BOUNDARY, len(jpeg))
        return head + jpeg + b"\r\n"


def decoded(data: bytes) -> MatLike:
    """Return the image an encoder made these bytes of."""
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    return image


def jpegs_of(recording: Path, camera: int, count: int) -> list[bytes]:
    """Return the first JPEG files of a recording's camera."""
    files = sorted((recording / "mav0" / f"cam{camera}" / "data").glob("*.jpg"))[:count]
    return [file.read_bytes() for file in files]
