"""Frames from a recording in EuRoC/ASL layout."""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.sources.asl_table import read_rows
from tracker.sources.image import check_first_size, decode_image, size_px
from tracker.sources.layout import camera_folders, find_mav0
from tracker.sources.protocol import ClosesOnExit, Stopwatch
from tracker.sources.sensor_yaml import read_camera
from tracker.types import Event, Frame, Image, Reason, Rejected


@dataclass(frozen=True, slots=True, order=True)
class _Entry:
    """One line of a camera's data.csv. late: why it cannot be used, "" if it can."""

    t_ns: int
    camera: int
    path: Path
    late: str = ""


class RecordingSource(ClosesOnExit):
    """Read the frames of all cameras, merged by time and then by camera, one image in memory at a time.

    A file that is missing or no whole image is `UNDECODABLE`, an image of another size than the calibration's is
    `WRONG_SIZE`, and a line whose time is not after the lines before it is `LATE` (recorders do write a frame twice):
    each is counted and the recording goes on.
    """

    def __init__(self, directory: Path, stopwatch: Stopwatch) -> None:
        """Read the tables and the calibration; no image yet.

        Args:
            directory: the folder that holds mav0, or mav0 itself.
            stopwatch: stamps `Frame.available_ns`.
        Raises:
            OperatorError: the layout, a table or a calibration is not as it must be.
        """
        folders = camera_folders(find_mav0(directory))
        self.camera_count = len(folders)
        self.cameras = _read_cameras(folders)
        self._tables = tuple(_read_table(folder, index) for index, folder in enumerate(folders))
        self._stopwatch = stopwatch
        self._sized = [False] * len(folders)
        self._closed = False

    def __iter__(self) -> Iterator[Event]:
        """Yield the frames in order of time.

        Raises:
            OperatorError: the first image of a camera has another size than its calibration.
        """
        for entry in heapq.merge(*self._tables):
            if self._closed:
                return
            yield self._event(entry)

    def close(self) -> None:
        """End the iteration."""
        self._closed = True

    def _event(self, entry: _Entry) -> Event:
        if entry.late:
            return Rejected(Reason.LATE, entry.late, entry.t_ns, entry.camera)
        try:
            data = entry.path.read_bytes()
        except OSError as error:
            return Rejected(Reason.UNDECODABLE, f"{entry.path}: {error.strerror}", entry.t_ns, entry.camera)
        image = decode_image(data)
        available_ns = self._stopwatch()
        if image is None:
            return Rejected(Reason.UNDECODABLE, f"{entry.path}: no whole image", entry.t_ns, entry.camera)
        if not self._fits(entry, image):
            width, height = size_px(image)
            return Rejected(Reason.WRONG_SIZE, f"{entry.path}: {width} x {height} px", entry.t_ns, entry.camera)
        return Frame(entry.camera, entry.t_ns, image, available_ns, data)

    def _fits(self, entry: _Entry, image: Image) -> bool:
        """Say whether an image has its calibration's size; a camera's first image must have it."""
        if self.cameras is None:
            return True
        camera = self.cameras[entry.camera]
        if not self._sized[entry.camera]:
            check_first_size(str(entry.path), image, camera)
            self._sized[entry.camera] = True
        return size_px(image) == (camera.width_px, camera.height_px)


def _read_cameras(folders: tuple[Path, ...]) -> tuple[Camera, ...] | None:
    """Read each folder's sensor.yaml; None if no folder has one."""
    paths = [folder / "sensor.yaml" for folder in folders]
    if not any(path.exists() for path in paths):
        return None
    return tuple(read_camera(path, path.parent.name) for path in paths)


def _read_table(folder: Path, camera: int) -> list[_Entry]:
    """Read a camera's data.csv into entries sorted by time."""
    data = folder / "data"
    if not data.is_dir() or not any(data.iterdir()):
        raise OperatorError(f"{data}: holds no images; copy the recording again")
    entries: list[_Entry] = []
    newest_ns = -1
    for row in read_rows(folder / "data.csv", columns=2):
        late = "" if row.t_ns > newest_ns else f"{row.where}: {row.t_ns} ns is not after {newest_ns} ns"
        newest_ns = max(newest_ns, row.t_ns)
        # A late line stands where it was found, so that the merge stays in order.
        entries.append(_Entry(newest_ns if late else row.t_ns, camera, data / row.fields[0], late))
    if not entries:
        raise OperatorError(f"{folder / 'data.csv'}: names no images; copy the recording again")
    return entries
