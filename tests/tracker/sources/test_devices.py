"""Cameras by the plugs they are in."""

from __future__ import annotations

from pathlib import Path

import pytest

from tracker.errors import OperatorError
from tracker.sources.capture import open_address
from tracker.sources.devices import is_numbered, plugged_cameras


def test_each_camera_is_named_once_by_its_first_stream(tmp_path: Path) -> None:
    plugs = tmp_path / "by-path"
    plugs.mkdir()
    for name, device in (
        ("usb-0:2:1.0-video-index0", "video0"),
        ("usbv2-0:2:1.0-video-index0", "video0"),
        ("usb-0:2:1.0-video-index1", "video1"),
        ("usb-0:1:1.0-video-index0", "video2"),
    ):
        (tmp_path / device).touch()
        (plugs / name).symlink_to(Path("..") / device)
    assert plugged_cameras(plugs) == {
        str(tmp_path / "video0"): str(plugs / "usb-0:2:1.0-video-index0"),
        str(tmp_path / "video2"): str(plugs / "usb-0:1:1.0-video-index0"),
    }
    assert plugged_cameras(tmp_path / "none") == {}


@pytest.mark.parametrize(
    ("address", "numbered"),
    [("0", True), ("/dev/video2", True), ("/dev/v4l/by-path/a-video-index0", False), ("rtsp://cam0/live", False)],
)
def test_a_number_is_no_lasting_name(address: str, numbered: bool) -> None:
    assert is_numbered(address) is numbered


def test_a_camera_that_does_not_open_is_told_with_those_there_are() -> None:
    with pytest.raises(OperatorError, match=r"'/dev/video63' cannot be opened; .* found: "):
        open_address("/dev/video63", "cam0")
