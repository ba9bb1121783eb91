"""A flight recorded with its frames flies again to the byte, and otherwise with other settings."""

from __future__ import annotations

import base64
import itertools
from pathlib import Path

import pytest

from bridge.log.reader import LogReader
from bridge.settings import Settings, load_settings
from tests.system.recordings import short_copy
from tests.tools.test_session import Time
from tools.replay import grounded, settings_of
from tools.request import Pace, RunRequest
from tools.session import run_session
from tracker.errors import OperatorError

PAIRS = 12


@pytest.fixture(scope="module")
def recording(lab_flight: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Copy the flight's first pairs, one of its images spoiled."""
    folder = short_copy(lab_flight, tmp_path_factory.mktemp("short"), PAIRS)
    spoiled = sorted((folder / "mav0" / "cam1" / "data").iterdir())[5]
    spoiled.unlink()
    spoiled.write_bytes(b"no image")
    return folder


def settings(frames: str = "png") -> Settings:
    return load_settings("lab").with_links(("memory:a", "memory:b")).with_frames(frames, None)


def fly(source: str, log: Path, chosen: Settings, pace: Pace = Pace.FAST) -> Path:
    run_session(RunRequest(chosen, source, log, pace, None, overwrite=False, quiet=True), Time().clocks())
    return log


def sent(log: Path) -> list[tuple[str, int, bytes]]:
    """Return topic, the loop's time and the bytes of every message in a log."""
    return [
        (record.topic, record.log_ns, base64.b64decode(record.value["raw"]))
        for record in LogReader(log).records()
        if record.topic.startswith("/mavlink/sent/")
    ]


@pytest.mark.parametrize("pace", list(Pace))
def test_a_replay_with_the_same_settings_sends_the_same_bytes(recording: Path, tmp_path: Path, pace: Pace) -> None:
    flown = fly(f"recording:{recording}", tmp_path / "a.mcap", settings(), pace)
    again = fly(
        f"log:{flown}", tmp_path / "b.mcap", grounded(settings_of(flown).with_frames("off", None), answered=False)
    )
    assert sent(again) == sent(flown)
    assert len(sent(flown)) > 2 * 2 * (PAIRS - 1)


def test_a_replay_of_a_replay_needs_frames_in_it_again(recording: Path, tmp_path: Path) -> None:
    flown = fly(f"recording:{recording}", tmp_path / "a.mcap", settings())
    again = fly(f"log:{flown}", tmp_path / "b.mcap", grounded(settings_of(flown), answered=False))
    third = fly(f"log:{again}", tmp_path / "c.mcap", grounded(settings_of(again), answered=False))
    assert sent(third) == sent(flown)


def test_other_settings_give_other_poses_of_the_same_instants(recording: Path, tmp_path: Path) -> None:
    flown = fly(f"recording:{recording}", tmp_path / "a.mcap", settings())
    changed = settings_of(flown).model_copy(
        update={"tracker": settings().tracker.model_copy(update={"method": "paper"})}
    )
    again = fly(f"log:{flown}", tmp_path / "b.mcap", grounded(changed, answered=False))
    poses = [{t_ns: raw for topic, t_ns, raw in sent(log) if "VISION_POSITION" in topic} for log in (flown, again)]
    shared = poses[0].keys() & poses[1].keys()
    assert len(shared) > PAIRS // 2
    assert any(poses[0][t_ns] != poses[1][t_ns] for t_ns in shared)


@pytest.mark.parametrize("profile", ["ardupilot", "px4"])
def test_a_replay_sends_an_autopilots_own_messages_though_none_is_there(
    recording: Path, tmp_path: Path, profile: str
) -> None:
    flown = fly(f"recording:{recording}", tmp_path / "a.mcap", settings())
    lab = settings_of(flown)
    named = lab.model_copy(update={"mavlink": lab.mavlink.model_copy(update={"profile": profile})})
    again = fly(f"log:{flown}", tmp_path / "b.mcap", grounded(named, answered=False))
    message = {"ardupilot": "VISION_SPEED_ESTIMATE", "px4": "ODOMETRY"}[profile]
    assert sum(topic.endswith(message) for topic, _, _ in sent(again)) >= 2 * (PAIRS - 2)


def test_a_replay_of_a_cut_log_flies_what_is_there(recording: Path, tmp_path: Path) -> None:
    flown = fly(f"recording:{recording}", tmp_path / "a.mcap", settings())
    before = sent(flown)
    data = flown.read_bytes()
    flown.write_bytes(data[: len(data) * 2 // 3])
    again = sent(fly(f"log:{flown}", tmp_path / "b.mcap", grounded(settings_of(flown), answered=False)))
    agreeing = list(itertools.takewhile(lambda pair: pair[0] == pair[1], zip(before, again, strict=False)))
    assert len(again) - len(agreeing) <= 4, "only what the tracker still held back when the frames ended may differ"
    assert len(agreeing) > 5


def test_a_config_of_another_version_asks_for_one(recording: Path, tmp_path: Path) -> None:
    flown = fly(f"recording:{recording}", tmp_path / "a.mcap", settings("off"))
    flown.write_bytes(flown.read_bytes().replace(b'"component_id"', b'"komponent_id"'))
    with pytest.raises(OperatorError, match=r"is not one of this version .*; name one with --config"):
        settings_of(flown)


def test_a_replay_reaches_no_autopilot_and_needs_no_key() -> None:
    lab = load_settings("lab")
    signed = lab.model_copy(update={"mavlink": lab.mavlink.model_copy(update={"signing_key": "gone.key"})})
    quiet = grounded(signed, answered=False)
    assert [link.uri for link in quiet.links] == ["memory:udpout:127.0.0.1:14550"]
    assert quiet.mavlink.signing_key == ""
    assert quiet.origin is None
    assert grounded(quiet, answered=False) == quiet
