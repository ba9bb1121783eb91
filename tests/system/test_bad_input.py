"""What an operator can get wrong, told in one line with exit code 2; and what a run must live with."""

from __future__ import annotations

import re
import shutil
import signal
import socket
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest

from bridge.log.reader import LogReader
from bridge.settings import shipped_configs
from tests.system.recordings import LINK, ROOT, command, images, posebridge, run, short_copy, summary_of

LAB = shipped_configs()["lab"].read_text(encoding="utf-8")


@pytest.fixture
def recording(lab_protocol: Path, tmp_path: Path) -> Path:
    """Copy the first four pairs of the protocol, to be spoilt."""
    return short_copy(lab_protocol, tmp_path / "short", 4)


def refusal(*arguments: str | Path) -> str:
    """Return the one line of a run that must be refused before anything is sent or written."""
    done = run(*arguments)
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith("posebridge: error: ")
    return done.stderr.removeprefix("posebridge: error: ").rstrip()


def refused(recording: Path, *more: str | Path) -> str:
    return refusal("--source", f"recording:{recording}", "--link", LINK, "--pace", "fast", *more)


def edited(path: Path, pattern: str, replacement: str) -> None:
    """Replace what a pattern finds in a file, which must be there."""
    text, count = re.subn(pattern, replacement, path.read_text(encoding="utf-8"), count=1, flags=re.MULTILINE)
    assert count == 1
    path.write_text(text, encoding="utf-8")


def test_a_recording_that_is_not_there(tmp_path: Path) -> None:
    assert "gone: no such directory" in refused(tmp_path / "gone")


def test_a_camera_without_images(recording: Path) -> None:
    for image in images(recording, 1):
        image.unlink()
    line = refused(recording)
    assert "cam1" in line
    assert "holds no images" in line


def test_a_calibration_of_another_size(recording: Path) -> None:
    edited(recording / "mav0/cam0/sensor.yaml", r"resolution: .*$", "resolution: [1280, 960]")
    done = run("--source", f"recording:{recording}", "--link", LINK, "--pace", "fast", "--quiet")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1, done.stderr
    assert "640 x 480" in done.stderr
    assert "1280 x 960" in done.stderr


def test_a_rotation_that_is_none(recording: Path) -> None:
    edited(recording / "mav0/cam1/sensor.yaml", r"data: \[-?0\.\d+", "data: [0.9")
    line = refused(recording)
    assert "cam1" in line
    assert "no rotation" in line
    assert "limit 0.0001" in line


def test_balls_in_a_line(recording: Path, tmp_path: Path) -> None:
    config = tmp_path / "line.toml"
    config.write_text(LAB.replace("position_mm = [0.0, 92.376, 0.0]", "position_mm = [0.0, -46.188, 0.0]"))
    assert "in a line within" in refused(recording, "--config", config)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("hue_deg = 56.0", "", ("hue_deg", "missing")),
        ("coast_limit_ms = 200.0", "coast_limit_s = 0.2", ("unknown key coast_limit_s", "known keys")),
    ],
)
def test_a_config_with_a_mistake(recording: Path, tmp_path: Path, old: str, new: str, words: tuple[str, ...]) -> None:
    config = tmp_path / "wrong.toml"
    assert old in LAB
    config.write_text(LAB.replace(old, new, 1))
    line = refused(recording, "--config", config)
    assert all(word in line for word in words), line


@pytest.mark.parametrize(
    ("link", "words"),
    [
        ("serial:/dev/ttyNOWHERE:115200", "/dev/ttyNOWHERE"),
        ("udpout:nowhere.invalid:14550", "nowhere.invalid"),
    ],
)
def test_a_link_that_does_not_open(recording: Path, tmp_path: Path, link: str, words: str) -> None:
    log = tmp_path / "a.mcap"
    source = f"recording:{recording}"
    assert words in refusal("--source", source, "--link", link, "--pace", "fast", "--log", log)
    assert not log.exists()


def test_a_log_where_none_can_be(recording: Path, tmp_path: Path) -> None:
    assert "does not exist; create it" in refused(recording, "--log", tmp_path / "missing" / "a.mcap")


def test_images_that_do_not_decode_are_counted_and_the_run_goes_on(recording: Path, tmp_path: Path) -> None:
    spoilt = images(recording, 1)
    spoilt[2].write_bytes(spoilt[2].read_bytes()[:20_000])
    spoilt[3].write_bytes(b"")
    summary = tmp_path / "a.json"
    done = run(
        "--source", f"recording:{recording}", "--link", LINK, "--pace", "fast", "--summary", summary, "--quiet"
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    figures = summary_of(summary)
    assert figures["rejected"]["undecodable"] == 2
    assert figures["frames"] == {"cam0": 4, "cam1": 2}
    assert figures["estimates_sent"] == 4


def test_a_run_and_a_replay_without_any_pose_end_with_1(recording: Path, tmp_path: Path) -> None:
    noise = np.random.default_rng(1)
    for image in (*images(recording, 0), *images(recording, 1)):
        cv2.imwrite(str(image), noise.integers(90, 110, (480, 640, 3)).astype(np.uint8))
    log = tmp_path / "a.mcap"
    options = ("--link", LINK, "--pace", "fast", "--quiet")
    done = run("--source", f"recording:{recording}", *options, "--log", log, "--log-frames", "png")
    again = posebridge("replay", log, "--quiet")
    assert (done.returncode, again.returncode) == (1, 1)
    assert done.stderr.startswith("posebridge: warning: no pose was found in any frame; last: not_found, ")
    assert "check colours (`posebridge colours`)" in done.stderr
    assert again.stderr == done.stderr


def test_a_run_without_any_pose_on_cameras_that_nobody_calibrated_says_what_comes_first(tmp_path: Path) -> None:
    paths = [tmp_path / "left.mp4", tmp_path / "right.mp4"]
    noise = np.random.default_rng(1)
    for path in paths:
        writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 15.0, (640, 480))
        for _ in range(3):
            writer.write(noise.integers(90, 110, (480, 640, 3)).astype(np.uint8))
        writer.release()
    done = run("--source", f"video:{paths[0]},{paths[1]}", "--link", LINK, "--pace", "fast", "--quiet")
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith(
        "calibrate the cameras' lenses and the room first (docs/rig.md), then check colours and marker"
    )


def test_a_full_disk_ends_the_log_and_not_the_run(recording: Path, tmp_path: Path, full_disk: Path) -> None:
    summary = tmp_path / "a.json"
    source = f"recording:{recording}"
    done = run("--source", source, "--link", LINK, "--pace", "fast", "--log", str(full_disk), "--summary", summary)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert "ended early" in done.stdout
    figures = summary_of(summary)
    assert figures["estimates_sent"] == 4
    assert "No space left on device" in figures["log"]["error"]
    assert figures["log"]["written"] == 0


def test_an_interrupted_run_closes_its_log_and_gives_its_figures(lab_flight: Path, tmp_path: Path) -> None:
    log, summary = tmp_path / "a.mcap", tmp_path / "a.json"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as autopilot:
        autopilot.bind(("127.0.0.1", 0))
        autopilot.settimeout(30.0)
        link = f"udpout:127.0.0.1:{autopilot.getsockname()[1]}"
        arguments = command("--source", f"recording:{lab_flight}", "--link", link, "--log", log, "--summary", summary)
        with subprocess.Popen(
            arguments, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as process:
            for _ in range(10):  # it flies
                autopilot.recv(2048)
            process.send_signal(signal.SIGINT)
            figures_shown, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert "estimates" in figures_shown
    figures = summary_of(summary)
    assert 1 <= figures["estimates_sent"] < 90
    assert figures["log"]["dropped"] == 0
    assert figures["log"]["error"] == ""
    reader = LogReader(log)
    logged = len(list(reader.records({"/estimate"})))
    assert figures["estimates_sent"] - logged in (0, 1), "only the turn that the signal cut short may be missing"
    assert reader.lost == ()


def test_a_config_of_another_folder_may_name_its_calibration(recording: Path, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    shutil.copytree(recording, tmp_path / "elsewhere" / "room")
    config = tmp_path / "elsewhere" / "room.toml"
    config.write_text(LAB.replace('calibration = ""', 'calibration = "room"'))
    source = f"recording:{recording}"
    done = run("--config", config, "--source", source, "--link", LINK, "--pace", "fast", "--quiet")
    assert (done.returncode, done.stderr) == (0, "")
