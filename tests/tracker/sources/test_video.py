"""Video files give frames at the container's own times."""

from __future__ import annotations

import itertools
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from tracker.camera import Camera, make_camera
from tracker.errors import OperatorError
from tracker.sources.video import FrameTimes, VideoSource
from tracker.types import Frame

REPOSITORY = Path(__file__).resolve().parents[3]
SIZE_PX = (160, 120)
START_NS = 1_700_000_000_000_000_000


def write_video(path: Path, rate_hz: float, frames: int, fourcc: str = "mp4v") -> Path:
    """Write frames whose grey value tells their number."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*fourcc), rate_hz, SIZE_PX)
    assert writer.isOpened()
    for number in range(frames):
        writer.write(np.full((SIZE_PX[1], SIZE_PX[0], 3), 20 * number, dtype=np.uint8))
    writer.release()
    return path


def camera(name: str, size_px: tuple[int, int] = SIZE_PX) -> Camera:
    return make_camera(name, size_px, (200.0, 200.0, 60.0, 60.0), (0.0, 0.0, 0.0, 0.0), np.eye(4))


def read(*paths: Path, start_ns: int = 0, expected: tuple[Camera, ...] | None = None) -> list[Frame]:
    ticks = itertools.count(1)
    with VideoSource(paths, lambda: next(ticks), start_ns, expected) as source:
        return [event for event in source if isinstance(event, Frame)]


@pytest.mark.parametrize(("suffix", "fourcc"), [("mp4", "mp4v"), ("avi", "MJPG"), ("mkv", "FFV1")])
def test_times_are_the_containers_and_belong_to_the_image_they_come_with(
    tmp_path: Path, suffix: str, fourcc: str
) -> None:
    paths = [write_video(tmp_path / f"{n}.{suffix}", 15.0, 5, fourcc) for n in range(2)]
    frames = read(*paths, start_ns=START_NS)
    assert [f.camera for f in frames] == [0, 1] * 5
    for number, frame in enumerate(frames):
        # Matroska holds whole milliseconds.
        assert frame.t_ns - START_NS == pytest.approx((number // 2) * 1e9 / 15.0, abs=0.5e6)
        assert frame.image.mean() == pytest.approx(20 * (number // 2), abs=4)
        assert frame.available_ns == number + 1


def test_files_of_different_rates_and_lengths_are_merged_by_time(tmp_path: Path) -> None:
    frames = read(write_video(tmp_path / "a.mp4", 30.0, 6), write_video(tmp_path / "b.mp4", 20.0, 8))
    assert [f.t_ns for f in frames] == sorted(f.t_ns for f in frames)
    assert [sum(f.camera == n for f in frames) for n in (0, 1)] == [6, 8]


def test_a_file_of_another_size_than_the_rigs_is_refused_at_its_first_frame(tmp_path: Path) -> None:
    paths = [write_video(tmp_path / f"{n}.mp4", 15.0, 2) for n in range(2)]
    assert len(read(*paths, expected=(camera("left"), camera("right")))) == 4
    with pytest.raises(OperatorError, match="160 x 120 px, the calibration of right is for 640 x 480 px"):
        read(*paths, expected=(camera("left"), camera("right", (640, 480))))


def test_what_is_no_video_is_told(tmp_path: Path) -> None:
    good = write_video(tmp_path / "good.mp4", 15.0, 2)
    text = tmp_path / "text.mp4"
    text.write_text("no video")
    with pytest.raises(OperatorError, match="cannot be opened as a video"):
        read(good, text)
    with pytest.raises(OperatorError, match="no such file"):
        read(good, tmp_path / "nowhere.mp4")
    with pytest.raises(OperatorError, match="1 files; 2 to 8 work"):
        read(good)


def test_an_unopenable_file_leaves_nothing_else_on_the_terminal(tmp_path: Path) -> None:
    (tmp_path / "a.mp4").write_text("no video")
    # A process of its own: FFmpeg takes its log level when first used, and the tests write videos through it.
    program = f"from tracker.sources.capture import open_file; open_file({str(tmp_path / 'a.mp4')!r})"
    done = subprocess.run([sys.executable, "-c", program], cwd=REPOSITORY, capture_output=True, text=True, check=False)
    assert done.stdout == ""
    assert done.stderr.startswith("Traceback")
    assert done.stderr.splitlines()[-1].startswith("tracker.errors.OperatorError: video ")


def test_a_container_without_times_counts_frames() -> None:
    times = FrameTimes(START_NS, 15.0)
    assert [times.next_ns(0.0) for _ in range(4)] == [START_NS + round(n * 1e9 / 15.0) for n in range(4)]


def test_times_never_go_back_at_a_splice() -> None:
    times = FrameTimes(0, 10.0)
    assert [times.next_ns(ms) for ms in (0.0, 90.0, 30.0, 130.0)] == [0, 90_000_000, 190_000_000, 290_000_000]


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, float("nan"), float("inf")])
def test_without_times_and_rate_there_is_no_time(rate_hz: float) -> None:
    times = FrameTimes(0, rate_hz)
    assert times.next_ns(0.0) == 0
    assert times.next_ns(0.0) is None
