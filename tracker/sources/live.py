"""Frames from live cameras: a thread each, the newest frame only."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack

import cv2

from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.rig import MAX_CAMERAS, MIN_CAMERAS
from tracker.sources.capture import READ_TIMEOUT_MS, Capture, open_address
from tracker.sources.image import frozen_image
from tracker.sources.live_camera import LiveCamera, latencies, mid_exposure_ns, set_up
from tracker.sources.mailbox import Mailbox
from tracker.sources.protocol import ClosesOnExit, Monotonic, Stopwatch
from tracker.types import Event, Frame, Image, Reason, Rejected, Silence

SILENCE_S = 0.05
BACKOFF_S = 0.5
JOIN_S = 1.5 * READ_TIMEOUT_MS / 1e3

Opener = Callable[[str, str], Capture]
"""Open the camera at (address) called (name), or raise OperatorError."""


class LiveSource(ClosesOnExit):
    """Hand over the newest frame of each camera, in order of arrival.

    Frames that a newer one replaced before they were taken are counted in `dropped`. A camera that stops is
    `DISCONNECTED`, once, and opened again until it answers; the others go on meanwhile. `Silence` comes whenever no
    camera gave anything for 50 ms.
    """

    cameras: tuple[Camera, ...] | None = None

    def __init__(
        self,
        live_cameras: Sequence[LiveCamera],
        monotonic: Monotonic,
        stopwatch: Stopwatch,
        opener: Opener = open_address,
        fewest: int = MIN_CAMERAS,
    ) -> None:
        """Open the cameras and start reading: a camera nobody reads would queue old frames.

        Args:
            live_cameras: in the rig's order.
            monotonic: the clock of `Frame.t_ns`; for a driver's own stamps to count it must be CLOCK_MONOTONIC.
            stopwatch: stamps `Frame.available_ns`.
            opener: opens a camera.
            fewest: cameras at least; one is enough where no rig is needed.
        Raises:
            OperatorError: too few or too many cameras, an address twice, one that cannot be opened.
        """
        _check_addresses(live_cameras, fewest)
        self.camera_count = len(live_cameras)
        self._monotonic = monotonic
        self._mailbox = Mailbox(len(live_cameras))
        self._stop = threading.Event()
        captures: list[Capture] = []
        warnings: list[str] = []
        with ExitStack() as opened:
            for camera in live_cameras:
                captures.append(opener(camera.address, camera.name))
                opened.callback(captures[-1].release)
                warnings.extend(set_up(captures[-1], camera))
            opened.pop_all()  # from here on each capture belongs to its reader
        self.warnings = tuple(warnings)
        readers = [
            _Reader(index, camera, opener, self._mailbox, self._stop, monotonic, stopwatch)
            for index, camera in enumerate(live_cameras)
        ]
        # The threads know nothing of this object, so that they end with it even if nobody closes it.
        weakref.finalize(self, self._stop.set)
        self._threads = [
            threading.Thread(target=reader.run, args=(capture,), name=f"camera {reader.name}", daemon=True)
            for reader, capture in zip(readers, captures, strict=True)
        ]
        for thread in self._threads:
            thread.start()

    def __iter__(self) -> Iterator[Event]:
        """Yield frames, troubles and silences until closed."""
        while not self._stop.is_set():
            event = self._mailbox.take(SILENCE_S)
            if event is not None:
                yield event
            elif not self._stop.is_set():
                self._check_readers()
                yield Silence(self._monotonic())

    def close(self) -> None:
        """Stop the threads and release the cameras; a camera that gives nothing holds this up for a read timeout."""
        self._stop.set()
        self._mailbox.close()
        for thread in self._threads:
            thread.join(JOIN_S)

    @property
    def dropped(self) -> tuple[int, ...]:
        """Return how many frames of each camera were too old to be worth handing over."""
        return self._mailbox.dropped

    def _check_readers(self) -> None:
        for thread in self._threads:
            if not thread.is_alive() and not self._stop.is_set():
                raise RuntimeError(f"the thread of {thread.name} ended; its traceback stands above")


class _Reader:
    """Read one camera in its own thread, through drops and reconnections."""

    def __init__(
        self,
        index: int,
        camera: LiveCamera,
        opener: Opener,
        mailbox: Mailbox,
        stop: threading.Event,
        monotonic: Monotonic,
        stopwatch: Stopwatch,
    ) -> None:
        self.name = camera.name
        self._index = index
        self._camera = camera
        self._opener = opener
        self._mailbox = mailbox
        self._stop = stop
        self._monotonic = monotonic
        self._stopwatch = stopwatch

    def run(self, capture: Capture) -> None:
        """Read until stopped; releases the capture."""
        connected: Capture | None = capture
        told = False
        while connected is not None:
            told = not self._read(connected) and told
            connected.release()
            if not told and not self._stop.is_set():
                self._tell(Reason.DISCONNECTED, f"camera {self.name}: {self._camera.address} gives no frames")
                told = True
            connected = self._reconnect()

    def _read(self, capture: Capture) -> bool:
        """Put frames into the mailbox until the camera drops or all is stopped; say whether there was any."""
        latency = latencies(self._camera, capture.get(cv2.CAP_PROP_FPS))
        any_frame = False
        while not self._stop.is_set() and capture.grab():
            arrival_ns = self._monotonic()
            t_ns = mid_exposure_ns(capture, arrival_ns, latency)
            image = _retrieved(capture)
            if image is None:
                self._tell(Reason.UNDECODABLE, f"camera {self.name}: a frame that is no image")
            else:
                self._mailbox.put(Frame(self._index, t_ns, image, self._stopwatch()))
            any_frame = True
        return any_frame

    def _reconnect(self) -> Capture | None:
        """Open the camera again, trying until it answers; None once all is stopped."""
        while not self._stop.wait(BACKOFF_S):
            try:
                capture = self._opener(self._camera.address, self.name)
            except OperatorError:
                continue
            set_up(capture, self._camera)
            return capture
        return None

    def _tell(self, reason: Reason, detail: str) -> None:
        self._mailbox.put(Rejected(reason, detail, self._monotonic(), self._index))


def _retrieved(capture: Capture) -> Image | None:
    """Return the image that was grabbed, None if the bytes were none."""
    try:
        done, pixels = capture.retrieve()
    except cv2.error:
        return None
    return frozen_image(pixels) if done else None


def _check_addresses(live_cameras: Sequence[LiveCamera], fewest: int) -> None:
    addresses = [camera.address for camera in live_cameras]
    if not fewest <= len(addresses) <= MAX_CAMERAS:
        raise OperatorError(
            f"camera: {len(addresses)} addresses; {fewest} to {MAX_CAMERAS} work, one a camera: camera:0,1"
        )
    for address in addresses:
        if addresses.count(address) > 1:
            raise OperatorError(f"camera: {address!r} stands twice; each camera needs an address of its own")
