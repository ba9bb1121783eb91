"""Calibrations in the files of other programs, there and back."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bridge.settings import load_settings, rig_of
from tests.tools.calibrate.files import EUROC, KALIBR, OPENCV, OPENCV_STEREO, ROS
from tests.tools.test_cli import LAB, posebridge, refusal
from tools.calibrate.formats.convert import FileFormat, read_cameras, write_cameras
from tools.calibrate.formats.poses import pose_of
from tracker.camera import Camera, make_camera
from tracker.errors import OperatorError
from tracker.maths.so3 import exp

SUFFIX = {"toml": ".toml", "kalibr": ".yaml", "ros": ".yaml", "euroc": ".yaml", "opencv": ".yml"}
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def read(text: str, path: Path, size_px: tuple[int, int] | None = None) -> tuple[Camera, ...]:
    path.write_text(text, encoding="utf-8")
    return read_cameras(path, size_px)


def assert_same(one: Camera, other: Camera) -> None:
    """Compare all but the name; coefficients left out are zero."""
    assert (one.width_px, one.height_px) == (other.width_px, other.height_px)
    np.testing.assert_allclose(one.K, other.K, rtol=1e-12)
    first, second = (np.append(c.distortion, np.zeros(8 - len(c.distortion))) for c in (one, other))
    np.testing.assert_allclose(first, second, atol=1e-14)
    np.testing.assert_allclose(pose_of(one), pose_of(other), atol=1e-12)


def test_kalibrs_chain_puts_camera_1_where_it_stands_to_camera_0(tmp_path: Path) -> None:
    cameras = read(KALIBR, tmp_path / "camchain.yaml")
    assert [camera.name for camera in cameras] == ["cam0", "cam1"]
    p_inC0 = np.array([0.3, -0.2, 2.0])
    p_inC1 = TURN @ p_inC0 + (-0.11, 0.02, 0.003)
    np.testing.assert_allclose(cameras[1].in_camera(p_inC0[None])[0], p_inC1, atol=1e-12)
    np.testing.assert_allclose(np.diag(cameras[0].K)[:2], (471.25, 470.75))
    np.testing.assert_allclose(cameras[1].distortion, (-0.29560, 0.08617, 5.6e-05, 0.00011))


def test_ros_camera_info_is_read_by_its_camera_matrix_not_its_projection(tmp_path: Path) -> None:
    (camera,) = read(ROS, tmp_path / "left.yaml")
    assert (camera.name, camera.width_px, camera.K[0, 0], camera.K[1, 2]) == (
        "narrow_stereo/left", 640, 441.783, 244.738,
    )  # fmt: skip
    assert list(camera.distortion) == [-0.351976, 0.111510, 0.001114, 0.000605, 0.0]


def test_opencvs_files_are_read_with_one_camera_and_with_two(tmp_path: Path) -> None:
    (camera,) = read(OPENCV, tmp_path / "camera.yml")
    assert (camera.K[0, 0], camera.K[1, 2], camera.distortion[4]) == (532.795, 233.9010, 0.16361)
    one, other = read(OPENCV_STEREO, tmp_path / "stereo.yml", (640, 480))
    assert list(one.distortion) == [-0.28, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.2]
    p_inC0 = np.array([0.3, -0.2, 2.0])
    np.testing.assert_allclose(other.in_camera(p_inC0[None])[0], TURN @ p_inC0 + (-3.3, 0.04, 0.05), atol=1e-12)


SAMPLES = {"kalibr": KALIBR, "ros": ROS, "euroc": EUROC, "opencv": OPENCV}
WAYS = [
    (name, through)
    for name in SAMPLES
    for through in FileFormat
    if (name, through) != ("opencv", FileFormat.KALIBR)  # its k3 does not fit: a refusal of its own
]


@pytest.mark.parametrize(("name", "through"), WAYS)
def test_a_file_is_the_same_calibration_after_a_way_through_each_format(
    name: str, through: FileFormat, tmp_path: Path
) -> None:
    cameras = read(SAMPLES[name], tmp_path / f"in{SUFFIX[name]}")
    path = tmp_path / ("between" if through in ("ros", "euroc") and len(cameras) > 1 else f"between{SUFFIX[through]}")
    lost = write_cameras(cameras, path, through)
    back = read_cameras(path)
    assert len(back) == len(cameras)
    for one, other in zip(cameras, back, strict=True):
        if lost:
            assert_same(
                Camera(one.name, one.width_px, one.height_px, one.K, one.distortion, np.eye(3), np.zeros(3)), other
            )
        else:
            assert_same(one, other)


_TURNS = st.tuples(*[st.floats(-3.0, 3.0)] * 3)
_PLACES = st.tuples(*[st.floats(-9.0, 9.0)] * 3)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    first=st.tuples(_TURNS, _PLACES),
    second=st.tuples(_TURNS, _PLACES),
    distortion=st.lists(st.floats(-0.9, 0.9), min_size=4, max_size=4),
)
def test_any_pair_keeps_its_relative_pose_in_every_format_that_has_poses(
    first: tuple[tuple[float, ...], tuple[float, ...]],
    second: tuple[tuple[float, ...], tuple[float, ...]],
    distortion: list[float],
    tmp_path: Path,
) -> None:
    cameras: list[Camera] = []
    for turn, place in (first, second):
        T_CtoW = np.eye(4)
        T_CtoW[:3, :3], T_CtoW[:3, 3] = exp(np.array(turn)), place
        cameras.append(
            make_camera(f"cam{len(cameras)}", (640, 480), (600.1, 601.7, 311.3, 222.9), tuple(distortion), T_CtoW)
        )
    relative = np.linalg.inv(pose_of(cameras[0])) @ pose_of(cameras[1])
    for into in (FileFormat.TOML, FileFormat.KALIBR, FileFormat.OPENCV, FileFormat.EUROC):
        path = tmp_path / ("folder" if into is FileFormat.EUROC else f"file{SUFFIX[into]}")
        write_cameras(cameras, path, into)
        back = read_cameras(path)
        found = np.linalg.inv(pose_of(back[0])) @ pose_of(back[1])
        np.testing.assert_allclose(found, relative, atol=1e-9)


def test_what_we_write_opencv_and_our_own_config_read(tmp_path: Path) -> None:
    cameras = read(KALIBR, tmp_path / "camchain.yaml")
    write_cameras(cameras, tmp_path / "a.xml", FileFormat.OPENCV)
    storage = cv2.FileStorage(str(tmp_path / "a.xml"), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(storage.getNode("M2").mat(), cameras[1].K)
    storage.release()
    write_cameras(cameras, tmp_path / "a.toml", FileFormat.TOML)
    head, rest = LAB.split("# Nominal cameras", 1)
    config = tmp_path / "config.toml"
    config.write_text(
        head + (tmp_path / "a.toml").read_text() + "\n[[marker.balls]]" + rest.split("[[marker.balls]]", 1)[1]
    )
    for one, other in zip(cameras, rig_of(load_settings(config), None).rig.cameras, strict=True):
        assert_same(one, other)
    write_cameras(cameras, tmp_path / "folder", FileFormat.EUROC)
    config.write_text(LAB.replace('calibration = ""', 'calibration = "folder"'))
    for one, other in zip(cameras, rig_of(load_settings(config), None).rig.cameras, strict=True):
        assert_same(one, other)


@pytest.mark.parametrize(
    ("text", "suffix", "complaint"),
    [
        (KALIBR.replace("radtan", "equidistant"), ".yaml", "distortion_model 'equidistant' cannot be represented"),
        (KALIBR.replace("pinhole", "omni"), ".yaml", "camera_model 'omni' cannot be represented"),
        (ROS.replace("plumb_bob", "equidistant"), ".yaml", "distortion_model 'equidistant' cannot be represented"),
        (EUROC.replace("radial-tangential", "equidistant"), ".yaml", "'equidistant' is unknown"),
        (OPENCV.replace("flags: 0", "fisheye_model: 1"), ".yml", "fisheye_model cannot be represented"),
        (OPENCV_STEREO, ".yml", "tells no image size"),
        (ROS.replace("image_width: 640\n", ""), ".yaml", "field `image_width` is missing"),
        (ROS.replace("441.783", "x"), ".yaml", "`camera_matrix` must be 9 finite numbers"),
        (
            KALIBR.replace("resolution: [752, 480]", "resolution: [75, 48]"),
            ".yaml",
            "lies outside the 75 x 48 px image",
        ),
        ("a: [", ".yaml", "is no YAML"),
        ("a: 1", ".yaml", "holds no calibration that is known"),
        ("[rig]\n", ".toml", "holds no [[rig.cameras]]"),
        ("[rig", ".toml", "not TOML"),
    ],
)
def test_a_file_we_cannot_use_is_one_line_that_names_it(text: str, suffix: str, complaint: str, tmp_path: Path) -> None:
    path = tmp_path / f"in{suffix}"
    with pytest.raises(OperatorError) as told:
        read(text, path)
    assert complaint in str(told.value)
    assert str(path) in str(told.value)
    assert "\n" not in str(told.value)


def test_a_folder_without_calibrations_is_told(tmp_path: Path) -> None:
    with pytest.raises(OperatorError, match="holds neither mav0 nor a file"):
        read_cameras(tmp_path)


def test_two_files_of_cameras_of_one_name_are_refused(tmp_path: Path) -> None:
    """Written again, one would take the other's place."""
    for name in ("left", "right"):
        (tmp_path / f"{name}.yaml").write_text(ROS)
    with pytest.raises(OperatorError, match="camera narrow_stereo/left comes twice") as told:
        read_cameras(tmp_path)
    assert str(tmp_path) in str(told.value)


def test_the_command_converts_and_says_what_is_lost(tmp_path: Path) -> None:
    (tmp_path / "camchain.yaml").write_text(KALIBR)
    done = posebridge("calibrate", "convert", tmp_path / "camchain.yaml", tmp_path / "a.toml")
    assert (done.returncode, done.stdout) == (0, "")
    done = posebridge("calibrate", "convert", tmp_path / "a.toml", tmp_path / "ros", "--to", "ros")
    assert done.returncode == 0
    assert "not in this format: the cameras' poses" in done.stderr
    assert sorted(path.name for path in (tmp_path / "ros").iterdir()) == ["cam0.yaml", "cam1.yaml"]
    again = refusal("calibrate", "convert", tmp_path / "camchain.yaml", tmp_path / "a.toml")
    assert "exists already" in again
    assert "give one of toml" in refusal("calibrate", "convert", tmp_path / "a.toml", tmp_path / "b.yaml")
    (tmp_path / "a.yml").write_text(OPENCV)
    five = refusal("calibrate", "convert", tmp_path / "a.yml", tmp_path / "c.yaml", "--to", "kalibr")
    assert "5 distortion coefficients, Kalibr's radtan has 4" in five
