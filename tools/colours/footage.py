"""Frames of a source, put together to instants, and a few dozen of them kept."""

from __future__ import annotations

from collections.abc import Iterable

from tracker.palette.learn import Instant
from tracker.types import Event, Frame, Rejected

KEPT = 60  # instants at most, spread evenly over what was read
KEPT_BYTES = 600_000_000
LEAST_KEPT = 12
APART_NS = 50_000_000  # frames further apart are of no one instant
PATIENCE_NS = 10_000_000_000  # of a live source that gives nothing


class Gathering:
    """Instants as they come: all at first, then every second, every fourth, so that few are held however many come."""

    def __init__(self, camera_count: int) -> None:
        self._camera_count = camera_count
        self._newest: dict[int, Frame] = {}
        self._stride = 1
        self.count = 0
        self.kept: list[Instant] = []

    def take(self, frame: Frame) -> None:
        """Take a frame; the last one missing completes an instant."""
        self._newest[frame.camera] = frame
        if len(self._newest) < self._camera_count:
            return
        instant = tuple(self._newest[camera] for camera in sorted(self._newest))
        times = [each.t_ns for each in instant]
        if max(times) - min(times) > APART_NS:
            del self._newest[times.index(min(times))]
            return
        self._newest.clear()
        if self.count % self._stride == 0:
            self.kept.append(instant)
        self.count += 1
        if len(self.kept) >= self._room(instant):
            self.kept = self.kept[::2]
            self._stride *= 2

    @staticmethod
    def _room(instant: Instant) -> int:
        size = sum(frame.image.nbytes for frame in instant)
        return max(LEAST_KEPT, min(KEPT, KEPT_BYTES // size))


def gather(events: Iterable[Event], sizes_px: tuple[tuple[int, int], ...], most: int) -> Gathering:
    """Read a source to its end, or `most` instants of it, or until a live one gave none for ten seconds.

    sizes_px: (width, height) of each camera; other images belong to another calibration and are left out.
    """
    gathering = Gathering(len(sizes_px))
    last_ns: int | None = None
    for event in events:
        if isinstance(event, Rejected):
            continue
        if isinstance(event, Frame) and event.image.shape[1::-1] == sizes_px[event.camera]:
            before = gathering.count
            gathering.take(event)
            if gathering.count > before:
                last_ns = event.t_ns
        last_ns = event.t_ns if last_ns is None else last_ns
        if gathering.count >= most or event.t_ns - last_ns > PATIENCE_NS:
            break
    return gathering
