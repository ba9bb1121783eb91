"""What holds for every source of frames, whatever it reads.

A new kind of source joins by a maker in `MAKERS`.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import pytest

from bridge.log.film import MEGABYTE, FilmTerms, FrameFormat
from bridge.log.footage import LogSource
from bridge.recorder import Recorder
from tests.bridge.recordings import marker
from tests.tracker.sources.mjpeg_server import MjpegCamera, decoded, jpegs_of
from tracker.sources.live import LiveSource
from tracker.sources.live_camera import LiveCamera
from tracker.sources.protocol import Source, Stopwatch
from tracker.sources.recording import RecordingSource
from tracker.sources.video import VideoSource
from tracker.types import Event, Frame, Rejected, Silence, Step, TrackState

FRAMES = 12
PATIENCE = 600  # events: 30 s of silences, for a machine under load
FIRST_READING_NS = 1_000


@contextmanager
def recording(lab_flight: Path, _: Path, stopwatch: Stopwatch) -> Iterator[Source]:
    """Read a recording."""
    yield RecordingSource(lab_flight, stopwatch)


@contextmanager
def video(lab_flight: Path, scratch: Path, stopwatch: Stopwatch) -> Iterator[Source]:
    """Read two files made of a recording's images."""
    paths = [scratch / f"{camera}.mp4" for camera in range(2)]
    for camera, path in enumerate(paths):
        writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 15.0, (640, 480))
        for jpeg in jpegs_of(lab_flight, camera, FRAMES):
            writer.write(decoded(jpeg))
        writer.release()
    yield VideoSource(paths, stopwatch)


@contextmanager
def live(lab_flight: Path, _: Path, stopwatch: Stopwatch) -> Iterator[Source]:
    """Read two network cameras, each of which takes an image whenever one has arrived."""
    monotonic = itertools.count(10**12, 10**6)
    with MjpegCamera(jpegs_of(lab_flight, 0, FRAMES)) as left, MjpegCamera(jpegs_of(lab_flight, 1, FRAMES)) as right:

        def stopwatch_and_next() -> int:
            left.release()
            right.release()
            return stopwatch()

        cameras = [LiveCamera(left.address, "left"), LiveCamera(right.address, "right")]
        yield LiveSource(cameras, lambda: next(monotonic), stopwatch_and_next)


@contextmanager
def log(lab_flight: Path, scratch: Path, stopwatch: Stopwatch) -> Iterator[Source]:
    """Read a log that a recording's frames were kept in."""
    recorded = RecordingSource(lab_flight, lambda: 0)
    assert recorded.cameras is not None
    with Recorder(
        scratch / "a.mcap",
        attachments={},
        metadata={},
        cameras=recorded.cameras,
        marker=marker(),
        wall_clock=lambda: 0,
        block_when_full=True,
        film=FilmTerms(FrameFormat.PNG, 100 * MEGABYTE),
    ) as recorder:
        for event in itertools.islice(recorded, 2 * FRAMES):
            recorder.take(event, Step(TrackState.SEARCHING), (), event.t_ns)
    yield LogSource(scratch / "a.mcap", stopwatch)


MAKERS = (recording, video, live, log)


@pytest.fixture(params=MAKERS, ids=lambda maker: maker.__name__)
def source(request: pytest.FixtureRequest, lab_flight: Path, tmp_path: Path) -> Iterator[Source]:
    ticks = itertools.count(FIRST_READING_NS)
    with request.param(lab_flight, tmp_path, lambda: next(ticks)) as made:
        yield made
        made.close()


def some_events(source: Source) -> list[Event]:
    """Return events until there are enough frames among them."""
    events: list[Event] = []
    frames = 0
    for event in itertools.islice(source, PATIENCE):
        events.append(event)
        frames += isinstance(event, Frame)
        if frames == FRAMES:
            return events
    raise AssertionError(f"{frames} frames among {PATIENCE} events")


def test_events_are_frames_silences_and_rejections(source: Source) -> None:
    assert all(isinstance(event, Frame | Silence | Rejected) for event in some_events(source))


def test_every_frame_is_a_colour_image_of_one_of_the_cameras_that_nobody_can_change(source: Source) -> None:
    for event in some_events(source):
        if isinstance(event, Frame):
            assert event.camera in range(source.camera_count)
            assert event.image.dtype == np.uint8
            assert event.image.shape == (480, 640, 3)
            assert event.image.flags.c_contiguous
            assert not event.image.flags.writeable


def test_images_handed_over_stay_as_they_were(source: Source) -> None:
    frames = [event for event in some_events(source) if isinstance(event, Frame)]
    assert len({frame.image.__array_interface__["data"][0] for frame in frames}) == len(frames)


def test_times_are_whole_nanoseconds_and_grow_with_each_frame_of_a_camera(source: Source) -> None:
    frames = [event for event in some_events(source) if isinstance(event, Frame)]
    assert all(type(frame.t_ns) is int for frame in frames)
    for camera in range(source.camera_count):
        times = [frame.t_ns for frame in frames if frame.camera == camera]
        assert all(before < after for before, after in itertools.pairwise(times))


def test_a_frame_says_when_it_stood_in_memory_by_the_stopwatch_that_was_given(source: Source) -> None:
    readings = [event.available_ns for event in some_events(source) if isinstance(event, Frame)]
    assert min(readings) >= FIRST_READING_NS
    assert len(set(readings)) == len(readings)


def test_calibration_if_it_comes_along_is_one_camera_each(source: Source) -> None:
    assert source.camera_count >= 2
    if source.cameras is not None:
        assert len(source.cameras) == source.camera_count


def test_after_closing_there_is_nothing_more_and_closing_again_does_no_harm(source: Source) -> None:
    events = iter(source)
    next(events)
    source.close()
    source.close()
    assert list(events) == []


def test_it_is_closed_at_the_end_of_a_with_block(source: Source) -> None:
    with source as entered:
        assert entered is source
    assert list(source) == []
