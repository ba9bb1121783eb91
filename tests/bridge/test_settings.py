"""What a config may hold, and what the operator reads when it holds something else."""

from __future__ import annotations

import colorsys
import math
import re
import tomllib
import typing
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from pydantic import BaseModel, ValidationError

from bridge.pack import MESSAGES
from bridge.settings import Settings, load_settings, marker_of, rig_of, shipped_configs
from bridge.settings.models import MessageName
from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.types import frozen_array

LAB = shipped_configs()["lab"].read_text(encoding="utf-8")
Write = Callable[[str], Path]

SENSOR_YAML = """\
sensor_type: camera
T_BS:
  rows: 4
  cols: 4
  data: [1, 0, 0, {x}, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
resolution: [640, 480]
camera_model: pinhole
intrinsics: [1190.0, 1190.0, 320.0, 240.0]
distortion_model: radial-tangential
distortion_coefficients: [0.0, 0.0, 0.0, 0.0]
"""


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Return a function that writes a config and returns its path."""

    def write_config(text: str) -> Path:
        path = tmp_path / "room.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write_config


def refusal(name_or_path: str | Path) -> str:
    """Return the one line that loading a bad config gives."""
    with pytest.raises(OperatorError) as caught:
        load_settings(name_or_path)
    message = str(caught.value)
    assert "\n" not in message
    return message


def edited(old: str, new: str) -> str:
    """Return the lab config with the first `old` replaced."""
    assert old in LAB
    return LAB.replace(old, new, 1)


def test_the_lab_config_loads_by_name_and_by_path() -> None:
    assert load_settings("lab") == load_settings(shipped_configs()["lab"])


def test_the_lab_config_states_every_key_so_that_each_one_is_explained() -> None:
    every_key = re.sub(r"(?m)^# (\w+ = )", r"\1", LAB)
    known: typing.Any = keys_of(Settings)
    known["rig"].pop("measured")  # no operator writes it: `calibrate room` does, with comments of its own
    assert keys_of(tomllib.loads(every_key)) == known


def test_a_key_left_out_has_the_value_the_lab_config_shows(write: Write) -> None:
    start, end = LAB.index("[tracker]"), LAB.index("[[links]]")
    assert load_settings(write(LAB[:start] + LAB[end:])) == load_settings("lab")


def test_settings_cannot_be_changed() -> None:
    with pytest.raises(ValidationError, match="frozen"):
        load_settings("lab").tracker.coast_limit_ms = 1.0


def test_the_nominal_cameras_stand_and_look_as_in_the_paper() -> None:
    chosen = rig_of(load_settings("lab"), None)
    one, other = chosen.rig.cameras
    assert chosen.nominal
    assert np.linalg.norm(one.p_CinW - other.p_CinW) == pytest.approx(4.5)
    assert one.R_CtoW[:, 2] @ other.R_CtoW[:, 2] == pytest.approx(0.0, abs=1e-9)  # eq. 1
    for camera, azimuth_deg in ((one, 45.0), (other, -135.0)):
        distance = np.linalg.norm(camera.p_CinW)
        assert distance == pytest.approx(4.5 / math.sqrt(2))
        assert camera.p_CinW[2] / distance == pytest.approx(math.cos(math.radians(45.0)))
        assert math.degrees(math.atan2(camera.p_CinW[1], camera.p_CinW[0])) == pytest.approx(azimuth_deg)
        assert camera.R_CtoW[2, 0] == pytest.approx(0.0)
        assert camera.project(np.zeros((1, 3)))[0] == pytest.approx(np.array([[319.5, 239.5]]))
        assert math.degrees(2 * math.atan(camera.width_px / 2 / camera.K[0, 0])) == pytest.approx(30.0)


def test_the_marker_is_the_papers_triangle() -> None:
    marker = marker_of(load_settings("lab").marker)
    assert [ball.name for ball in marker.balls] == ["yellow", "green", "orange"]
    sides = [np.linalg.norm(marker.points_inB[i] - marker.points_inB[i - 1]) for i in range(3)]
    assert sides == pytest.approx([0.16] * 3, abs=1e-6)
    assert marker.points_inB.mean(axis=0) == pytest.approx(np.zeros(3), abs=1e-9)
    assert {ball.radius_m for ball in marker.balls} == {0.0075}


def test_each_paint_lies_in_its_own_box() -> None:
    for ball in marker_of(load_settings("lab").marker).balls:
        hue_deg, saturation, value = hsv(ball.colour.bgr)
        assert abs(hue_deg - ball.colour.hue_deg) < 1.0
        assert saturation > ball.colour.saturation_min
        assert value > ball.colour.value_min


def test_the_sources_own_calibration_counts_before_the_nominal_one() -> None:
    cameras = (plain_camera("left"), plain_camera("right"))
    chosen = rig_of(load_settings("lab"), cameras)
    assert chosen.rig.cameras == cameras
    assert not chosen.nominal


def test_a_calibration_in_the_config_counts_before_the_sources_own(tmp_path: Path, write: Write) -> None:
    for index in (0, 1):
        folder = tmp_path / "calibrated" / "mav0" / f"cam{index}"
        folder.mkdir(parents=True)
        (folder / "sensor.yaml").write_text(SENSOR_YAML.format(x=index), encoding="utf-8")
    settings = load_settings(write(edited('calibration = ""', 'calibration = "calibrated"')))
    chosen = rig_of(settings, (plain_camera("left"), plain_camera("right")))
    assert [camera.p_CinW[0] for camera in chosen.rig.cameras] == [0.0, 1.0]
    assert not chosen.nominal


def test_a_calibration_that_is_not_there_is_named_with_its_key(tmp_path: Path, write: Write) -> None:
    settings = load_settings(write(edited('calibration = ""', 'calibration = "gone"')))
    with pytest.raises(OperatorError, match=r"\[rig\] calibration: .*gone"):
        rig_of(settings, None)


def test_a_source_with_more_cameras_than_the_rig_is_refused() -> None:
    with pytest.raises(OperatorError, match=r"2 cameras \(nominal\) but the source has 3"):
        rig_of(load_settings("lab"), None, camera_count=3)


def test_links_of_the_command_line_replace_the_configs() -> None:
    settings = load_settings("lab").with_links(("udpout:10.0.0.2:14550", "serial:/dev/ttyUSB0:921600"))
    assert [link.uri for link in settings.links] == ["udpout:10.0.0.2:14550", "serial:/dev/ttyUSB0:921600"]
    assert {link.messages for link in settings.links} == {None}  # the profile's


def test_a_config_may_ask_for_every_message_that_can_be_packed_and_no_other() -> None:
    assert set(typing.get_args(MessageName)) == set(MESSAGES)


def test_without_links_on_the_command_line_the_configs_stay() -> None:
    assert load_settings("lab").with_links(()) == load_settings("lab")


def test_an_unknown_config_lists_the_shipped_ones() -> None:
    assert refusal("labb").startswith("config labb: cannot be read (No such file or directory); shipped configs: lab;")


def test_a_folder_in_place_of_a_config_is_refused(tmp_path: Path) -> None:
    assert "cannot be read (Is a directory)" in refusal(tmp_path)


def test_a_syntax_error_names_its_line(write: Write) -> None:
    assert "room.toml: not TOML" in refusal(write("[room]\nroom_yaw_deg = \n"))
    assert "line 2" in refusal(write("[room]\nroom_yaw_deg = \n"))


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "room.toml"
    path.write_bytes(b"\xff\xfe[room]")
    assert "not UTF-8 text at byte 0" in refusal(path)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        (
            "coast_limit_ms = 200.0",
            "coast_limit_ms = -5.0",
            "[tracker] coast_limit_ms = -5.0 ms: must be greater than 0 ms; correct it",
        ),
        ("# system_id = 1", "system_id = 255", "[mavlink] system_id = 255: must be at most 254; correct it"),
        (
            "acceleration_m_s2 = 10.0",
            "acceleration_m_s2 = nan",
            "[tracker.process] acceleration_m_s2 = nan m/s^2: must be a finite number; correct it",
        ),
        (
            "radius_mm = 7.5",
            'radius_mm = "7.5"',
            "[[marker.balls]] yellow: radius_mm = '7.5' mm: must be a number; correct it",
        ),
        (
            "position_mm = [-80.0, -46.188, 0.0]",
            "position_mm = [-80.0, -46.188]",
            "[[marker.balls]] yellow: position_mm = [-80.0, -46.188] mm: holds 2 values, wanted 3; correct it",
        ),
        ("bgr = [24, 186, 198]", "bgr = [24, 186, 300]", "[[marker.balls]] yellow: bgr = 300: must be at most 255"),
        (
            'fourcc = "MJPG"',
            'fourcc = "MJPEG"',
            "[[rig.cameras]] cam0: fourcc = 'MJPEG': has 5 characters, wanted 4; correct it",
        ),
        ("width_px = 640", "width_px = 640.5", "[[rig.cameras]] cam0: width_px = 640.5 px: must be a whole number"),
        ('method = "ekf"', 'method = "ukf"', "[tracker] method = 'ukf': must be 'ekf' or 'paper'; correct it"),
        ("lag_rounds = 0", "lag_rounds = 16", "[tracker] lag_rounds = 16: must be at most 15"),
        ("lag_rounds = 0", "lag_rounds = true", "[tracker] lag_rounds = True: must be a whole number"),
        (
            '# messages = ["VISION_POSITION_ESTIMATE"]',
            'messages = ["GPS_INPUT"]',
            "[[links]] udpout:127.0.0.1:14550: messages = 'GPS_INPUT': must be 'VISION",
        ),
        ("longitude_deg = 34.8", "longitude_deg = 181.0", "[origin] longitude_deg = 181.0 deg: must be at most 180"),
        ("altitude_m = 30.0", "altitude_m = 0.0", "[origin] altitude_m = 0 m: leaves ArduPilot's height wrong"),
        ("fx_px = 1194.2562584\n", "", "[[rig.cameras]] cam0: fx_px missing; add it"),
        ("room_yaw_deg = 0.0", "", "[room] room_yaw_deg missing; add it"),
        ('name = "cam1"', 'name = "cam0"', "[rig] camera name cam0 comes twice; each must differ"),
        ("channel = 4", "channel = 3", "[vehicle] servo channel 3 comes twice; each must differ"),
        ("mass_g = 55.0", "mass_g = 0.0", "[vehicle] mass_g = 0.0 g: must be greater than 0 g"),
        ('name = "green"', 'name = "yellow"', "[marker] ball name yellow comes twice; each must differ"),
        ("hue_deg = 56.0", "", "[[marker.balls]] yellow: colour missing: the tracker tells balls apart by paint; add"),
        (
            "hue_deg = 56.0",
            "hue_deg = 50.0",
            "[marker] hues of yellow and orange lie 27 deg apart, their tolerances need 32 deg; lessen",
        ),
        (
            "coast_limit_ms = 200.0",
            "coast_limit = 200.0",
            "[tracker] unknown key coast_limit; did you mean coast_limit_ms? known keys: method, coast_limit_ms,",
        ),
        ("[mavlink]", "[mavlnk]", "unknown key mavlnk; did you mean mavlink? known keys: room, rig, marker, tracker,"),
        (
            "[tracker.process]\n",
            "[tracker.process]\nmass_kg = 1\n",
            "[tracker.process] unknown key mass_kg; known keys",
        ),
        ("radius_mm = 7.5\n", "radius_m = 7.5\n", "[[marker.balls]] yellow: unknown key radius_m; did you mean radius"),
        (LAB[: LAB.index("\n[rig]\n")], "room = 3\n", "room = 3: must be a table; correct it"),
    ],
)
def test_a_mistake_is_told_with_section_key_value_limit_and_remedy(
    write: Write, old: str, new: str, complaint: str
) -> None:
    path = write(edited(old, new))
    message = refusal(path)
    assert message.startswith(f"config {path}: {complaint}")


def test_several_mistakes_are_counted(write: Write) -> None:
    text = edited("# system_id = 1", "system_id = 0").replace("component_id = 197", "component_id = 0")
    assert refusal(write(text)).endswith("[mavlink] system_id = 0: must be at least 1; correct it (and 1 more)")


def test_the_papers_method_cannot_wait_for_later_rounds(write: Write) -> None:
    text = edited('method = "ekf"', 'method = "paper"').replace("lag_rounds = 0", "lag_rounds = 1")
    assert '[tracker] lag_rounds = 1 rounds: the method "paper" keeps no track' in refusal(write(text))


def keys_of(value: object) -> object:
    """Return the nested key names of a TOML table or of a model, lists by the union over their tables."""
    if isinstance(value, Mapping):
        return {key: keys_of(item) for key, item in value.items()}
    if isinstance(value, list) and value and isinstance(value[0], Mapping):
        return keys_of(value[0])
    if isinstance(value, type) and issubclass(value, BaseModel):
        return {key: keys_of(entry.annotation) for key, entry in value.model_fields.items()}
    inner = typing.get_args(value)
    if inner and isinstance(inner[0], type) and issubclass(inner[0], BaseModel):
        return keys_of(inner[0])
    return None


def plain_camera(name: str) -> Camera:
    """Return a camera at the room's origin that looks up."""
    return Camera(
        name,
        640,
        480,
        frozen_array(np.eye(3)),
        frozen_array(np.zeros(4)),
        frozen_array(np.eye(3)),
        frozen_array(np.zeros(3)),
    )


def hsv(bgr: tuple[int, int, int]) -> tuple[float, float, float]:
    """Return hue [deg], saturation and value, 0..1, of a colour."""
    hue, saturation, value = colorsys.rgb_to_hsv(*(channel / 255 for channel in reversed(bgr)))
    return hue * 360, saturation, value
