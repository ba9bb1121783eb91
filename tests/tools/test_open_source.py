"""From a source URI to frames and the rig to see them by."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from bridge.settings import ChosenRig, RigOrigin, load_settings
from tests.tracker.paper_rig import paper_rig
from tools.open_source import doubts_of, open_source
from tools.request import Clocks
from tracker.errors import OperatorError
from tracker.types import Frame

CLOCKS = Clocks(monotonic=lambda: 0, stopwatch=lambda: 7, wall=lambda: 0, sleep_s=lambda _seconds: None)
POSES = (
    "1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 2, 0, 0, 0, 1",
    "1, 0, 0, 1, 0, -1, 0, 0, 0, 0, -1, 2, 0, 0, 0, 1",
)
SENSOR_YAML = """\
T_BS: {{rows: 4, cols: 4, data: [{pose}]}}
resolution: [64, 48]
camera_model: pinhole
intrinsics: [120.0, 120.0, 32.0, 24.0]
distortion_model: radial-tangential
distortion_coefficients: [0.0, 0.0, 0.0, 0.0]
"""


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Write one black stereo pair in EuRoC/ASL layout."""
    for index, pose in enumerate(POSES):
        folder = tmp_path / "mav0" / f"cam{index}"
        (folder / "data").mkdir(parents=True)
        (folder / "sensor.yaml").write_text(SENSOR_YAML.format(pose=pose), encoding="utf-8")
        (folder / "data.csv").write_text("#timestamp [ns],filename\n5,5.png\n", encoding="utf-8")
        cv2.imwrite(str(folder / "data" / "5.png"), np.zeros((48, 64, 3), np.uint8))
    return tmp_path


def test_a_recording_is_seen_by_its_own_calibration(recording: Path) -> None:
    opened = open_source(f"recording:{recording}", load_settings("lab"), CLOCKS)
    with opened.source as source:
        events = list(source)
    assert [(event.camera, event.t_ns, event.available_ns) for event in events if isinstance(event, Frame)] == [
        (0, 5, 7),
        (1, 5, 7),
    ]
    assert opened.chosen.origin is RigOrigin.SOURCE
    assert opened.chosen.rig.cameras[1].p_CinW.tolist() == [1.0, 0.0, 2.0]
    assert not opened.live
    assert opened.warnings == ()


@pytest.mark.parametrize(
    ("uri", "complaint"),
    [
        ("film:a,b", "unknown kind 'film'"),
        ("recording:gone", "recording gone: no such directory"),
        ("video:a.mp4,b.mp4", "video a.mp4: no such file"),
        ("video:a,b,c", "rig: 2 cameras (nominal) but the source has 3"),
        ("camera:0,0", "camera"),
    ],
)
def test_a_source_that_cannot_be_had_is_refused_in_one_line(uri: str, complaint: str) -> None:
    with pytest.raises(OperatorError) as caught:
        open_source(uri, load_settings("lab"), CLOCKS)
    assert complaint in str(caught.value)
    assert "\n" not in str(caught.value)


def test_calibrated_cameras_by_number_are_doubted_and_those_by_plug_or_network_are_not() -> None:
    measured = ChosenRig(paper_rig(), RigOrigin.MEASURED)
    assert "change places when plugged anew" in doubts_of(measured, ("0", "2"))[0]
    assert doubts_of(measured, ("/dev/v4l/by-path/a-video-index0", "http://cam1/")) == ()
    assert "not calibrated" in doubts_of(ChosenRig(paper_rig(), RigOrigin.NOMINAL), ("0", "2"))[0]
