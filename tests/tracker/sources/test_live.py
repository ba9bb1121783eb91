"""Live cameras: the newest frame only, stamped at mid-exposure, through drops and reconnections.

The cameras are real HTTP streams on loopback, read by OpenCV. The clocks are the tests' own.
"""

from __future__ import annotations

import gc
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest

from tests.tracker.sources.mjpeg_server import MjpegCamera, jpegs_of
from tracker.errors import OperatorError
from tracker.sources.capture import open_address
from tracker.sources.live import LiveSource
from tracker.sources.live_camera import LiveCamera
from tracker.types import Event, Frame, Reason, Rejected, Silence

IMAGES = 15
PATIENCE = 600  # events: 30 s of silences, for a machine under load


class Gate:
    """A stopwatch that counts the left camera's readings, one a frame, and can hold the thread that reads it."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._readings = 0
        self._hold_at: int | None = None
        self._held = False

    def read(self) -> int:
        if threading.current_thread().name != "camera left":
            return 0
        with self._changed:
            self._readings += 1
            if self._readings == self._hold_at:
                self._held = True
                self._changed.notify_all()
                self._changed.wait_for(lambda: self._hold_at is None)
            return self._readings

    def hold_at(self, further: int) -> None:
        """Hold the reading thread at the reading that is so many after the last."""
        with self._changed:
            self._hold_at = self._readings + further

    def wait_until_held(self) -> None:
        with self._changed:
            assert self._changed.wait_for(lambda: self._held, timeout=30.0)

    def let_go(self) -> None:
        with self._changed:
            self._hold_at = None
            self._changed.notify_all()


@pytest.fixture
def left(lab_flight: Path) -> Iterator[MjpegCamera]:
    with MjpegCamera(jpegs_of(lab_flight, 0, IMAGES)) as camera:
        yield camera


@pytest.fixture
def right(lab_flight: Path) -> Iterator[MjpegCamera]:
    with MjpegCamera(jpegs_of(lab_flight, 1, IMAGES)) as camera:
        yield camera


def pair(left: MjpegCamera, right: MjpegCamera, latency_ms: float | None = None) -> list[LiveCamera]:
    return [
        LiveCamera(camera.address, name, latency_ms=latency_ms) for camera, name in ((left, "left"), (right, "right"))
    ]


@contextmanager
def live(
    left: MjpegCamera,
    right: MjpegCamera,
    monotonic: Callable[[], int] = lambda: 10**12,
    stopwatch: Callable[[], int] = lambda: 0,
) -> Iterator[LiveSource]:
    # On a machine under load a frame that is due may well take longer than a second.
    opener = partial(open_address, read_timeout_ms=60_000)
    with LiveSource(pair(left, right, latency_ms=50.0), monotonic, stopwatch, opener) as source:
        yield source
        # A reader that waits for a frame notices the end at once if the camera goes first.
        left.kill()
        right.kill()


def until(events: Iterator[Event], wanted: Callable[[Event], bool]) -> list[Event]:
    """Return the events up to and with the first wanted one."""
    seen: list[Event] = []
    for _, event in zip(range(PATIENCE), events, strict=False):
        seen.append(event)
        if wanted(event):
            return seen
    raise AssertionError(f"nothing wanted among {PATIENCE} events")


def first(events: Iterator[Event], wanted: Callable[[Event], bool]) -> Event:
    """Return the first wanted event."""
    return until(events, wanted)[-1]


def shows(camera: MjpegCamera, index: int, number: int) -> Callable[[Event], bool]:
    """Say whether an event is a camera's frame with the image of that number."""
    return lambda event: isinstance(event, Frame) and event.camera == index and camera.which(event.image) == number


def is_lost(event: Event) -> bool:
    return isinstance(event, Rejected) and event.reason is Reason.DISCONNECTED and event.camera == 0


def test_frames_of_both_cameras_arrive_as_they_are_released(left: MjpegCamera, right: MjpegCamera) -> None:
    with live(left, right) as source:
        assert source.camera_count == 2
        assert source.cameras is None
        events = iter(source)
        for number in (1, 2, 3):
            left.release()
            first(events, shows(left, 0, number))
            right.release()
            frame = first(events, shows(right, 1, number))
            assert isinstance(frame, Frame)
            assert frame.image.shape == (480, 640, 3)
            assert not frame.image.flags.writeable


def test_a_slow_reader_gets_the_newest_frame_and_the_others_are_counted(left: MjpegCamera, right: MjpegCamera) -> None:
    gate = Gate()
    with live(left, right, stopwatch=gate.read) as source:
        events = iter(source)
        left.release()
        first(events, shows(left, 0, 1))
        dropped_before = source.dropped[0]
        # Held at the eleventh, the thread has put the ten before it into the mailbox.
        gate.hold_at(further=11)
        left.release(11)
        gate.wait_until_held()
        frame = first(events, lambda event: isinstance(event, Frame) and event.camera == 0)
        assert isinstance(frame, Frame)
        assert left.which(frame.image) == 11
        assert source.dropped[0] - dropped_before == 9
        gate.let_go()
        first(events, shows(left, 0, 12))


def test_a_frame_is_stamped_at_its_arrival_less_the_latency(left: MjpegCamera, right: MjpegCamera) -> None:
    with live(left, right, monotonic=lambda: 7_000_000_000) as source:
        left.release()
        frame = first(iter(source), shows(left, 0, 1))
        assert isinstance(frame, Frame)
        assert frame.t_ns == 6_950_000_000


def test_silence_is_told_with_the_time(left: MjpegCamera, right: MjpegCamera) -> None:
    with live(left, right, monotonic=lambda: 7_000_000_000) as source:
        assert first(iter(source), lambda event: isinstance(event, Silence)) == Silence(7_000_000_000)


def test_a_lost_camera_is_told_once_and_comes_back_while_the_other_goes_on(
    left: MjpegCamera, right: MjpegCamera
) -> None:
    with live(left, right) as source:
        events = iter(source)
        left.release()
        first(events, shows(left, 0, 1))
        left.kill()
        lost = first(events, is_lost)
        assert isinstance(lost, Rejected)
        assert "camera left: http" in lost.detail
        right.release()
        since = until(events, shows(right, 1, 1))
        left.start()
        left.release()
        since += until(events, shows(left, 0, 2))
        assert not any(is_lost(event) for event in since)


def test_a_camera_that_hangs_is_told_and_comes_back(left: MjpegCamera, right: MjpegCamera) -> None:
    with LiveSource(pair(left, right), lambda: 0, lambda: 0) as source:
        events = iter(source)
        first(events, is_lost)
        left.release()
        first(events, shows(left, 0, 1))


def test_a_camera_that_cannot_be_opened_is_told_with_its_address_and_a_remedy(
    left: MjpegCamera, right: MjpegCamera
) -> None:
    right.kill()
    with pytest.raises(OperatorError, match=f"camera right: '{right.address}' cannot be opened; nothing answered"):
        LiveSource(pair(left, right), lambda: 0, lambda: 0)


@pytest.mark.parametrize(
    ("address", "remedy"),
    [
        ("/dev/video97", "check that it is plugged in"),
        ("97", "check that it is plugged in"),
        ("videotestsrc ! fakesink", "GStreamer|appsink"),
    ],
)
def test_a_device_that_is_not_there_is_told_with_a_remedy(left: MjpegCamera, address: str, remedy: str) -> None:
    with pytest.raises(OperatorError, match=remedy) as error:
        LiveSource([LiveCamera(left.address, "left"), LiveCamera(address, "right")], lambda: 0, lambda: 0)
    assert "\n" not in str(error.value)


def test_an_address_twice_or_one_alone_is_refused() -> None:
    with pytest.raises(OperatorError, match="'0' stands twice"):
        LiveSource([LiveCamera("0", "left"), LiveCamera("0", "right")], lambda: 0, lambda: 0)
    with pytest.raises(OperatorError, match="1 addresses; 2 to 8 work"):
        LiveSource([LiveCamera("0", "left")], lambda: 0, lambda: 0)


def test_what_cannot_be_locked_is_told(left: MjpegCamera, right: MjpegCamera) -> None:
    cameras = [LiveCamera(left.address, "left"), LiveCamera(right.address, "right", lock=False, width_px=1280)]
    with LiveSource(cameras, lambda: 0, lambda: 0) as source:
        locked, size = source.warnings
    assert locked.startswith("camera left: exposure and white balance cannot be locked through FFMPEG")
    assert size == "camera right: gives 640 x 480 px, not 1280 x None px"


def camera_threads() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name.startswith("camera ")]


def test_closing_ends_the_threads_and_the_iteration_though_no_frame_comes(
    left: MjpegCamera, right: MjpegCamera
) -> None:
    with LiveSource(pair(left, right), lambda: 0, lambda: 0) as source:
        events = iter(source)
        next(events)
        threads = camera_threads()
        assert len(threads) == 2
        source.close()
        assert not any(thread.is_alive() for thread in threads)
        assert list(events) == []


def test_a_source_that_is_forgotten_ends_its_threads(left: MjpegCamera, right: MjpegCamera) -> None:
    source = LiveSource(pair(left, right), lambda: 0, lambda: 0)
    threads = camera_threads()
    assert len(threads) == source.camera_count
    del source
    gc.collect()
    for thread in threads:
        thread.join(timeout=30.0)
        assert not thread.is_alive()
