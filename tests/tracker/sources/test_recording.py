"""A recording gives its frames in order, and says what is wrong with it."""

from __future__ import annotations

import itertools
import shutil
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.tracker.sources.conftest import PAIRS
from tests.tracker.sources.mjpeg_server import decoded
from tracker.errors import OperatorError
from tracker.sources.recording import RecordingSource
from tracker.types import Event, Frame, Reason, Rejected


def read(directory: Path) -> list[Event]:
    ticks = itertools.count(1)
    with RecordingSource(directory, lambda: next(ticks)) as source:
        return list(source)


def image_of(recording: Path, camera: int, row: int) -> Path:
    return sorted((recording / "mav0" / f"cam{camera}" / "data").iterdir())[row]


def told(recording: Path) -> str:
    """Return the one line an operator gets for this recording."""
    with pytest.raises(OperatorError) as error:
        read(recording)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_frames_of_all_cameras_come_in_order_of_time_and_camera(recording: Path) -> None:
    frames = read(recording)
    assert [(f.t_ns, f.camera) for f in frames if isinstance(f, Frame)] == [
        (1_700_000_000_000_000_000 + t, camera) for t in (0, 66_666_667, 133_333_333) for camera in (0, 1)
    ]
    assert [f.available_ns for f in frames if isinstance(f, Frame)] == [1, 2, 3, 4, 5, 6]


def test_the_image_is_the_files(recording: Path) -> None:
    frame = read(recording)[1]
    assert isinstance(frame, Frame)
    np.testing.assert_array_equal(frame.image, decoded(image_of(recording, 1, 0).read_bytes()))
    assert not frame.image.flags.writeable


def test_mav0_itself_may_be_named(recording: Path) -> None:
    assert len(read(recording / "mav0")) == len(read(recording)) == 2 * PAIRS


def test_the_whole_of_both_recordings_is_read(lab_protocol: Path, lab_flight: Path) -> None:
    for directory, pairs in ((lab_protocol, 38), (lab_flight, 90)):
        events = read(directory)
        assert len(events) == 2 * pairs
        assert all(isinstance(event, Frame) for event in events)


def test_the_calibration_comes_with_the_recording(recording: Path) -> None:
    cameras = RecordingSource(recording, lambda: 0).cameras
    assert cameras is not None
    assert [camera.name for camera in cameras] == ["cam0", "cam1"]
    np.testing.assert_allclose(cameras[0].p_CinW, (1.635823103, 1.603178617, 2.236899312))
    np.testing.assert_allclose(cameras[1].K[0, [0, 2]], (1198.325342, 315.155617))
    # Both stand on the paper's half circle and look at the middle of the room.
    for camera in cameras:
        to_room = -camera.p_CinW / np.linalg.norm(camera.p_CinW)
        assert camera.R_CtoW[:, 2] @ to_room > 0.99


def test_a_recording_without_calibration_gives_frames_and_no_cameras(recording: Path) -> None:
    for path in recording.glob("mav0/cam*/sensor.yaml"):
        path.unlink()
    assert RecordingSource(recording, lambda: 0).cameras is None
    assert len(read(recording)) == 2 * PAIRS


@pytest.mark.parametrize("camera_count", [3, 8])
def test_up_to_eight_cameras_are_read_in_order_of_their_number(recording: Path, camera_count: int) -> None:
    for index in range(2, camera_count):
        shutil.copytree(recording / "mav0" / "cam0", recording / "mav0" / f"cam{index}")
    (recording / "mav0" / "imu0").mkdir()
    events = read(recording)
    assert [event.camera for event in events if isinstance(event, Frame)] == list(range(camera_count)) * PAIRS


def test_lines_may_end_in_carriage_returns_and_the_header_may_be_missing(recording: Path) -> None:
    table = recording / "mav0" / "cam0" / "data.csv"
    table.write_bytes("\r\n".join(table.read_text().splitlines()[1:]).encode())
    assert len(read(recording)) == 2 * PAIRS


def spoil_with_text(path: Path) -> None:
    path.write_text("no image")


def spoil_empty(path: Path) -> None:
    path.write_bytes(b"")


def spoil_cut_short(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def spoil_cut_short_jpeg(path: Path) -> None:
    _, jpeg = cv2.imencode(".jpg", decoded(path.read_bytes()))
    path.write_bytes(jpeg.tobytes()[: len(jpeg) // 2])


@pytest.mark.parametrize("spoil", [spoil_with_text, spoil_empty, spoil_cut_short, spoil_cut_short_jpeg, Path.unlink])
@pytest.mark.parametrize("row", [0, 1])
def test_a_file_that_is_no_image_is_left_out_and_the_rest_goes_on(
    recording: Path, spoil: Callable[[Path], None], row: int
) -> None:
    path = image_of(recording, 1, row)
    spoil(path)
    events = read(recording)
    assert len(events) == 2 * PAIRS
    [rejected] = [event for event in events if isinstance(event, Rejected)]
    assert rejected.reason is Reason.UNDECODABLE
    assert path.name in rejected.detail
    assert (rejected.camera, rejected.t_ns) == (1, int(path.stem))


def test_a_jpeg_padded_with_zeros_is_whole(recording: Path) -> None:
    path = image_of(recording, 0, 0)
    _, jpeg = cv2.imencode(".jpg", decoded(path.read_bytes()))
    path.write_bytes(jpeg.tobytes() + bytes(300))
    assert all(isinstance(event, Frame) for event in read(recording))


def test_a_grey_image_becomes_a_colour_one(recording: Path) -> None:
    path = image_of(recording, 0, 0)
    cv2.imwrite(str(path), decoded(path.read_bytes())[:, :, 1])
    frame = read(recording)[0]
    assert isinstance(frame, Frame)
    assert frame.image.shape == (480, 640, 3)


def test_a_later_image_of_another_size_is_left_out(recording: Path) -> None:
    path = image_of(recording, 0, 1)
    cv2.imwrite(str(path), np.zeros((240, 320, 3), dtype=np.uint8))
    [rejected] = [event for event in read(recording) if isinstance(event, Rejected)]
    assert rejected.reason is Reason.WRONG_SIZE
    assert "320 x 240 px" in rejected.detail


def test_a_first_image_of_another_size_says_the_calibration_is_not_for_it(recording: Path) -> None:
    cv2.imwrite(str(image_of(recording, 1, 0)), np.zeros((240, 320, 3), dtype=np.uint8))
    line = told(recording)
    assert "320 x 240 px" in line
    assert "640 x 480 px" in line


def test_a_line_written_twice_or_out_of_order_is_late_and_the_rest_goes_on(recording: Path) -> None:
    table = recording / "mav0" / "cam0" / "data.csv"
    header, first, second, third = table.read_text().splitlines()
    table.write_text("\n".join((header, first, first, third, second)))
    events = read(recording)
    late = [event for event in events if isinstance(event, Rejected)]
    assert [(event.reason, event.camera) for event in late] == [(Reason.LATE, 0)] * 2
    assert "data.csv line 3" in late[0].detail
    times = [event.t_ns for event in events if isinstance(event, Frame)]
    assert times == sorted(times)
    assert len(times) == 2 * PAIRS - 1


@pytest.mark.parametrize(
    "row",
    ["soon,a.png", "1.5,a.png", "-1,a.png", "170000000", "1700,", "9223372036854775808,a.png", "²,a.png", "\udcff"],
)
def test_a_malformed_line_is_told_with_file_and_number(recording: Path, row: str) -> None:
    table = recording / "mav0" / "cam1" / "data.csv"
    table.write_bytes(table.read_bytes() + row.encode(errors="surrogateescape"))
    assert "cam1/data.csv line 5: " in told(recording)


def test_what_is_missing_is_named(recording: Path, tmp_path: Path) -> None:
    assert "no such directory" in told(tmp_path / "nowhere")
    (tmp_path / "empty").mkdir()
    assert "neither mav0 nor cam0" in told(tmp_path / "empty")
    (recording / "mav0" / "cam1" / "data.csv").rename(tmp_path / "kept")
    assert "cam1/data.csv: cannot be read (No such file or directory)" in told(recording)
    (recording / "mav0" / "cam1" / "data.csv").write_text("#timestamp [ns],filename\n")
    assert "names no images" in told(recording)
    shutil.rmtree(recording / "mav0" / "cam1" / "data")
    assert "cam1/data: holds no images" in told(recording)
    shutil.rmtree(recording / "mav0" / "cam1")
    assert "1 cameras; 2 to 8 work" in told(recording)
