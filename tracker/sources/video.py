"""Frames from video files, one a camera, that started at the same instant."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

import cv2

from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.rig import MAX_CAMERAS, MIN_CAMERAS
from tracker.sources.capture import Capture, open_file
from tracker.sources.image import check_first_size, frozen_image
from tracker.sources.protocol import ClosesOnExit, Stopwatch
from tracker.types import Event, Frame, Reason, Rejected


class FrameTimes:
    """Turn the times a container gives into strictly increasing ones.

    Some containers give none (all zero) or go back at a splice: from the first time that is not after the one before,
    each frame is one period later than the last.
    """

    def __init__(self, start_ns: int, rate_hz: float) -> None:
        """Begin at `start_ns`; `rate_hz` is the container's frame rate, not positive if it has none."""
        self._start_ns = start_ns
        self._rate_hz = rate_hz if math.isfinite(rate_hz) and rate_hz > 0 else None
        self._newest_ns: int | None = None
        self._counted_from: tuple[int, int] | None = None  # time and number of frames since

    def next_ns(self, position_ms: float) -> int | None:
        """Return the time of the frame at the container's `position_ms` [ns]; None if it has neither time nor rate."""
        t_ns = self._start_ns + round(position_ms * 1e6)
        if self._counted_from is None and self._newest_ns is not None and t_ns <= self._newest_ns:
            self._counted_from = (self._newest_ns, 0)
        if self._counted_from is not None:
            if self._rate_hz is None:
                return None
            base_ns, count = self._counted_from
            self._counted_from = (base_ns, count + 1)
            t_ns = base_ns + round((count + 1) * 1e9 / self._rate_hz)
        self._newest_ns = t_ns
        return t_ns


class VideoSource(ClosesOnExit):
    """Read two to eight video files, merged by time and then by camera."""

    cameras: tuple[Camera, ...] | None = None

    def __init__(
        self,
        paths: Sequence[Path],
        stopwatch: Stopwatch,
        start_ns: int = 0,
        expected: tuple[Camera, ...] | None = None,
        fewest: int = MIN_CAMERAS,
    ) -> None:
        """Open the files.

        Args:
            paths: one file a camera, in the rig's order.
            stopwatch: stamps `Frame.available_ns`.
            start_ns: stream time at which every file starts [ns].
            expected: the rig's cameras, to refuse a file of another image size at its first frame.
            fewest: files at least; one is enough where no rig is needed.
        Raises:
            OperatorError: too few or too many files, or one that is missing or no video.
        """
        if not fewest <= len(paths) <= MAX_CAMERAS:
            raise OperatorError(
                f"video: {len(paths)} files; {fewest} to {MAX_CAMERAS} work, one a camera: video:LEFT,RIGHT"
            )
        for path in paths:
            if not path.is_file():
                raise OperatorError(f"video {path}: no such file; check the path")
        self.camera_count = len(paths)
        self._paths = tuple(paths)
        self._stopwatch = stopwatch
        self._start_ns = start_ns
        self._expected = expected
        self._closed = False
        self._captures: list[Capture] = []
        with ExitStack() as opened:
            for path in paths:
                self._captures.append(open_file(str(path)))
                opened.callback(self._captures[-1].release)
            self._files = opened.pop_all()

    def __iter__(self) -> Iterator[Event]:
        """Yield the frames in order of time.

        Raises:
            OperatorError: a file without a single frame or without times, or of another size than expected.
        """
        for t_ns, index, first in heapq.merge(*(self._grabbed(index) for index in range(self.camera_count))):
            yield self._event(t_ns, index, first)
            # Between two events the reader may have closed the files.
            if self._closed:
                return

    def close(self) -> None:
        """Close the files."""
        self._closed = True
        self._files.close()

    def _grabbed(self, index: int) -> Iterator[tuple[int, int, bool]]:
        """Yield (time, camera, is it the first) each time a frame of one file stands ready to be retrieved.

        The merge asks a file for its next frame only after the last one was handed over, so what is retrieved is
        what was grabbed.
        """
        capture, path = self._captures[index], self._paths[index]
        times = FrameTimes(self._start_ns, capture.get(cv2.CAP_PROP_FPS))
        first = True
        while not self._closed and capture.grab():
            # After the grab OpenCV gives the time of the frame grabbed; before it, that of the frame before.
            t_ns = times.next_ns(capture.get(cv2.CAP_PROP_POS_MSEC))
            if t_ns is None:
                raise OperatorError(f"video {path}: holds neither frame times nor a frame rate; convert it to MP4")
            yield t_ns, index, first
            first = False
        if first and not self._closed:
            raise OperatorError(f"video {path}: holds no frames; record it again")

    def _event(self, t_ns: int, index: int, first: bool) -> Event:
        done, pixels = self._captures[index].retrieve()
        if not done:
            return Rejected(Reason.UNDECODABLE, f"{self._paths[index]} at {t_ns} ns", t_ns, index)
        image = frozen_image(pixels)
        available_ns = self._stopwatch()
        if first and self._expected is not None:
            check_first_size(f"video {self._paths[index]}", image, self._expected[index])
        return Frame(index, t_ns, image, available_ns)
