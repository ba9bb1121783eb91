"""A calibration file is read, or refused in one line that names it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from tracker.errors import OperatorError
from tracker.sources.recording import RecordingSource


def told(recording: Path) -> str:
    """Return the one line an operator gets for this recording."""
    with pytest.raises(OperatorError) as error:
        RecordingSource(recording, lambda: 0)
    assert "\n" not in str(error.value)
    return str(error.value)


def edit_yaml(recording: Path, **changes: object) -> None:
    path = recording / "mav0" / "cam1" / "sensor.yaml"
    document = {**yaml.safe_load(path.read_text()), **changes}
    path.write_text(yaml.safe_dump({key: value for key, value in document.items() if value is not None}))


def test_a_pose_may_be_written_as_rows(recording: Path) -> None:
    before = RecordingSource(recording, lambda: 0).cameras
    path = recording / "mav0" / "cam1" / "sensor.yaml"
    data = yaml.safe_load(path.read_text())["T_BS"]["data"]
    edit_yaml(recording, T_BS=np.reshape(data, (4, 4)).tolist())
    after = RecordingSource(recording, lambda: 0).cameras
    assert before is not None
    assert after is not None
    np.testing.assert_array_equal(before[1].R_CtoW, after[1].R_CtoW)


def test_one_calibration_of_two_is_not_enough(recording: Path) -> None:
    (recording / "mav0" / "cam1" / "sensor.yaml").unlink()
    assert "cam1/sensor.yaml: cannot be read" in told(recording)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"intrinsics": None}, "field `intrinsics` is missing"),
        ({"T_BS": None}, "field `T_BS` is missing"),
        ({"resolution": None}, "field `resolution` is missing"),
        ({"camera_model": "omni"}, "camera_model 'omni' is unknown; known: pinhole"),
        ({"distortion_model": "equidistant"}, "'equidistant' is unknown; known: radial-tangential, radtan"),
        ({"intrinsics": [1200.0, 1200.0, 320.0]}, "`intrinsics` must be 4 finite numbers"),
        ({"intrinsics": "wide"}, "`intrinsics` must be 4 finite numbers"),
        ({"intrinsics": [-1.0, 1200.0, 320.0, 240.0]}, "must be positive"),
        ({"intrinsics": [1200.0, 1200.0, 640.0, 240.0]}, "lies outside the 640 x 480 px image"),
        ({"distortion_coefficients": [0.1]}, "must be 4 or 5 or 8 finite numbers"),
        ({"distortion_coefficients": [0.1, float("nan"), 0.0, 0.0]}, "finite numbers"),
        ({"resolution": [0, 480]}, "resolution 0 x 480 px must be positive"),
        ({"T_BS": {"data": [1.0] * 12}}, "`T_BS` must be 4 x 4 numbers"),
        ({"T_BS": {"data": (2.0 * np.eye(4)).ravel().tolist()}}, "holds no rotation"),
        ({"T_BS": {"data": np.diag([1.0, 1.0, -1.0, 1.0]).ravel().tolist()}}, "mirrors"),
    ],
)
def test_a_calibration_that_cannot_be_is_told_with_its_file(
    recording: Path, changes: dict[str, object], expected: str
) -> None:
    edit_yaml(recording, **changes)
    line = told(recording)
    assert expected in line
    assert "cam1/sensor.yaml" in line


@pytest.mark.parametrize("text", ["intrinsics: [1, 2", "just words", "", "\x00"])
def test_a_calibration_that_is_no_yaml_is_told_in_one_line(recording: Path, text: str) -> None:
    (recording / "mav0" / "cam0" / "sensor.yaml").write_text(text)
    assert "cam0/sensor.yaml" in told(recording)
