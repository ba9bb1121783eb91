"""`posebridge colours` as its user meets it: a page, a picture, a config, an exit code."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import cv2
import numpy as np
import pytest

from bridge.settings import load_settings
from tests.system.recordings import LINK, images, run, short_copy, summary_of
from tests.tools.test_cli import LAB, posebridge, refusal
from tools.colours.footage import KEPT, Gathering
from tools.colours.picture import write_picture
from tools.colours.write import recoloured
from tracker.errors import OperatorError
from tracker.rig import Colour
from tracker.types import Frame

COLOURS = {name: Colour(10.0 * k, 4.5, 0.3, 0.2, (k, 2, 3)) for k, name in enumerate(("yellow", "green", "orange"))}


def test_a_recording_gives_page_picture_and_a_config_that_tracks(lab_protocol: Path, tmp_path: Path) -> None:
    recording = short_copy(lab_protocol, tmp_path / "short", 12)
    picture, config, summary = tmp_path / "a.png", tmp_path / "a.toml", tmp_path / "a.json"
    done = posebridge("colours", "--source", f"recording:{recording}", "--picture", picture, "--write", config)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout + done.stderr
    assert "marker found in 12 of 12 instants" in done.stdout
    assert "Good to fly." in done.stdout
    image = cv2.imread(str(picture))
    assert image is not None
    assert image.shape[1] >= 2 * 640
    tracked = run(
        "--config", config, "--source", f"recording:{recording}", "--link", LINK, "--pace", "fast", "--quiet",
        "--summary", summary,
    )  # fmt: skip
    assert (tracked.returncode, tracked.stderr) == (0, "")
    assert summary_of(summary)["estimates_sent"] == 12


def test_a_clash_is_named_in_json_and_speaks_against_a_flight(lab_protocol: Path, tmp_path: Path) -> None:
    recording = short_copy(lab_protocol, tmp_path / "short", 10)
    for path in (recording / "mav0/cam1/data").iterdir():
        image = cv2.imread(str(path))
        assert image is not None
        cv2.circle(image, (100, 400), 4, (50, 157, 33), cv2.FILLED)
        cv2.imwrite(str(path), image)
    done = posebridge("colours", "--source", f"recording:{recording}", "--json")
    assert (done.returncode, done.stderr) == (1, "")
    figures = json.loads(done.stdout)
    assert figures["good"] is False
    (clash,) = (clash for clash in figures["clashes"] if clash["serious"])
    assert (clash["camera"], clash["ball"], clash["kind"]) == ("cam1", "green", "looks_like")
    assert abs(clash["region"]["left"] - 96) <= 2
    assert [ball["good"] for ball in figures["balls"]] == [True, False, True]


def test_footage_without_the_marker_is_one_line(lab_protocol: Path, tmp_path: Path) -> None:
    recording = short_copy(lab_protocol, tmp_path / "short", 3)
    for camera in (0, 1):
        for path in (recording / f"mav0/cam{camera}/data").iterdir():
            cv2.imwrite(str(path), np.full((480, 640, 3), 120, dtype=np.uint8))
    line = refusal("colours", "--source", f"recording:{recording}", "--write", tmp_path / "a.toml")
    assert "no marker in any of 3 instants" in line
    assert not (tmp_path / "a.toml").exists()


def filmed(recording: Path, folder: Path) -> str:
    """Make videos, which bring no calibration, of a recording; return the source."""
    paths = [folder / f"{camera}.avi" for camera in (0, 1)]
    for camera, path in enumerate(paths):
        writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 15.0, (640, 480))
        for each in images(recording, camera):
            image = cv2.imread(str(each))
            assert image is not None
            writer.write(image)
        writer.release()
    return "video:" + ",".join(map(str, paths))


def test_before_anybody_knows_where_the_cameras_stand_colours_are_learned_by_what_moves(
    lab_protocol: Path, tmp_path: Path
) -> None:
    config, picture, learned = tmp_path / "new.toml", tmp_path / "a.png", tmp_path / "learned.toml"
    config.write_text(LAB.replace("2.25],", "2.5],", 1).replace("hue_deg = 23.0", "hue_deg = 8.0"), encoding="utf-8")
    source = filmed(short_copy(lab_protocol, tmp_path / "short", 12), tmp_path)
    done = posebridge("colours", "--config", config, "--source", source, "--picture", picture, "--write", learned)
    assert done.returncode == 1, done.stderr
    assert "Good to calibrate the room with" in done.stdout
    assert cv2.imread(str(picture)) is not None
    hues_deg = [ball.hue_deg for ball in load_settings(learned).marker.balls]
    assert hues_deg == pytest.approx([56.0, 126.0, 24.0], abs=8.0)  # of the balls, as config/lab.toml has them
    as_json = posebridge("colours", "--config", config, "--source", source, "--json")
    figures = json.loads(as_json.stdout)
    assert (figures["good"], figures["calibrated"], figures["seen"]) == (False, False, {"cam0": 12, "cam1": 12})


def test_a_picture_that_cannot_be_written_is_one_line(tmp_path: Path, full_disk: Path) -> None:
    (tmp_path / "a.png").symlink_to(full_disk)
    with pytest.raises(OperatorError, match="No space left on device"):
        write_picture(np.zeros((4, 4, 3), dtype=np.uint8), tmp_path / "a.png")


def test_what_cannot_be_is_refused_before_any_footage_is_read(tmp_path: Path) -> None:
    there = tmp_path / "there.toml"
    there.write_text("mine")
    assert "5 frames must be 10 to 100000" in refusal("colours", "--frames", "5")
    assert "exists already" in refusal("colours", "--source", "sim:hover", "--write", there)
    assert "create it" in refusal("colours", "--source", "sim:hover", "--picture", tmp_path / "no" / "a.png")
    assert "ends in .png" in refusal("colours", "--source", "sim:hover", "--picture", there)
    assert there.read_text() == "mine"


def test_a_copied_config_differs_in_the_colours_only_and_keeps_every_comment(tmp_path: Path) -> None:
    text = recoloured(LAB.replace("hue_deg = 56.0", "hue_deg = 56.0  # mine"), COLOURS, tmp_path, tmp_path)
    assert "hue_deg = 0.0  # mine" in text
    changed = [
        (old, new) for old, new in zip(LAB.splitlines(), text.splitlines(), strict=True) if old != new
    ]  # fmt: skip
    assert len(changed) == 15
    assert all(old.split("=")[0] == new.split("=")[0] for old, new in changed)
    path = tmp_path / "a.toml"
    path.write_text(text)
    balls = load_settings(path).marker.balls
    assert [ball.hue_deg for ball in balls] == [0.0, 10.0, 20.0]
    assert balls[2].bgr == (2, 2, 3)


def test_a_relative_calibration_leads_to_the_same_place_from_another_folder(tmp_path: Path) -> None:
    text = LAB.replace('calibration = ""', 'calibration = "room"')
    moved = tomllib.loads(recoloured(text, COLOURS, tmp_path / "a", tmp_path / "b"))["rig"]["calibration"]
    assert (tmp_path / "b" / moved).resolve() == (tmp_path / "a" / "room").resolve()
    assert tomllib.loads(recoloured(text, COLOURS, tmp_path, tmp_path))["rig"]["calibration"] == "room"


@pytest.mark.parametrize("count", [3, KEPT, 1000])
def test_few_instants_are_kept_however_many_come_and_they_span_all(count: int) -> None:
    gathering = Gathering(2)
    blank = np.zeros((2, 2, 3), dtype=np.uint8)
    for k in range(count):
        gathering.take(Frame(0, k * 10**8, blank))
        gathering.take(Frame(1, k * 10**8 + 10**6, blank))
    assert gathering.count == count
    assert min(count, KEPT // 2) <= len(gathering.kept) <= KEPT
    steps = {int(step) for step in np.diff([instant[0].t_ns for instant in gathering.kept])}
    assert len(steps) == 1
    assert gathering.kept[-1][0].t_ns + steps.pop() >= count * 10**8


def test_a_frame_that_one_camera_lost_pairs_nothing_wrongly() -> None:
    gathering = Gathering(2)
    blank = np.zeros((2, 2, 3), dtype=np.uint8)
    for camera, t_ms in ((0, 0), (1, 1), (0, 100), (0, 200), (1, 201), (1, 301), (0, 400), (1, 401)):
        gathering.take(Frame(camera, t_ms * 10**6, blank))
    assert [tuple(f.t_ns // 10**6 for f in one) for one in gathering.kept] == [(0, 1), (200, 201), (400, 401)]
