"""The demo, whole: rendered frames in, MAVLink over a real socket out, a helicopter that flies on nothing else."""

from __future__ import annotations

import io
import itertools
import json
from collections import Counter
from pathlib import Path
from typing import Any

import cv2
import pytest
from rich.console import Console

from bridge.log.reader import LogReader, Record
from tests.system.layouts import PANELS, curves, found, foxglove_layout, named_topics, series, shown
from tools.demo import LOG, PLOT, SUMMARY, VERDICT, DemoResult, run_demo
from tools.replay import grounded, met_autopilot, settings_of
from tools.request import Clocks, DemoRequest, FrameFormat, Pace, RunRequest
from tools.session import run_session

DURATION_S = 16.0
FRAME_NS = 66_666_667 * 3 // 2


def ticking() -> Clocks:
    """Return clocks that go on a microsecond whenever they are read."""
    reading = itertools.count(1, 1000)
    return Clocks(lambda: next(reading), lambda: next(reading), lambda: 0, lambda _: None)


def talk(log: Path) -> list[tuple[str, int, Any]]:
    """Return what was said both ways, and what was known of the autopilot and its clock."""
    return [
        (record.topic, record.log_ns, record.value.get("raw") or {**record.value, "link": ""})
        for record in LogReader(log).records()
        if record.topic.startswith("/mavlink/") or record.topic in ("/timesync", "/autopilot")
    ]


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> DemoResult:
    """Fly once for all tests here, as fast as it goes."""
    request = DemoRequest(DURATION_S, 1, tmp_path_factory.mktemp("demo"), Pace.FAST, FrameFormat.PNG)
    return run_demo(request, ticking(), Console(file=io.StringIO()))


@pytest.fixture(scope="module")
def records(result: DemoResult) -> list[Record]:
    return list(LogReader(result.out / LOG).records())


def test_the_helicopter_holds_its_path_on_what_the_bridge_sends(result: DemoResult) -> None:
    missed = [line for line in result.verdict.lines if not line.passed]
    assert not missed


def test_an_estimate_goes_out_for_every_pair_of_frames(result: DemoResult) -> None:
    assert result.summary.estimates_sent >= 0.98 * 15 * DURATION_S
    assert result.summary.lost == 0
    assert result.summary.resets == 0


def test_log_summary_verdict_and_picture_lie_in_the_folder(result: DemoResult) -> None:
    assert (result.out / LOG).stat().st_size > 10_000
    assert json.loads((result.out / SUMMARY).read_text())["estimates_sent"] == result.summary.estimates_sent
    assert json.loads((result.out / VERDICT).read_text())["passed"] is True
    picture = cv2.imread(str(result.out / PLOT))
    assert picture is not None
    assert picture.shape[1] > 1000


def test_the_log_holds_what_the_autopilot_was_asked_to_tell_and_how_to_align_its_clock(
    result: DemoResult, records: list[Record]
) -> None:
    counts = Counter(record.topic for record in records)
    for name in ("SERVO_OUTPUT_RAW", "RC_CHANNELS", "ATTITUDE", "LOCAL_POSITION_NED", "RAW_IMU"):
        assert counts[f"/mavlink/received/{name}"] > 40 * DURATION_S
    offset_ns = [record.value["offset_ns"] for record in records if record.topic == "/timesync"][-1]
    attitudes = [record.value for record in records if record.topic == "/mavlink/received/ATTITUDE"]
    late_ns = [value["arrived_ns"] - value["autopilot_ns"] - offset_ns for value in attitudes]
    assert max(map(abs, late_ns)) < FRAME_NS  # time stands still between two frames of the cameras
    assert (result.out / LOG).with_suffix(".tlog").stat().st_size > 100_000


def test_a_replay_carries_on_the_whole_talk_again_to_the_byte(result: DemoResult, tmp_path: Path) -> None:
    flown, again = result.out / LOG, tmp_path / "again.mcap"
    settings = grounded(settings_of(flown).with_frames("off", None), answered=met_autopilot(flown))
    request = RunRequest(settings, f"log:{flown}", again, Pace.FAST, None, overwrite=False, quiet=True)
    run_session(request, ticking())
    said = talk(flown)
    assert {topic for topic, _, _ in said} >= {"/timesync", "/autopilot", "/mavlink/sent/COMMAND_INT"}
    assert talk(again) == said


def test_the_foxglove_layout_shows_every_panel_once_and_kinds_that_viewers_have() -> None:
    layout = foxglove_layout()
    assert sorted(shown(layout["layout"])) == sorted(layout["configById"])
    assert {name.partition("!")[0] for name in layout["configById"]} == PANELS


def test_the_foxglove_layout_names_only_what_the_log_holds(records: list[Record]) -> None:
    panels = foxglove_layout()["configById"]
    assert set().union(*map(named_topics, panels.values())) <= {record.topic for record in records}
    for name, panel in panels.items():
        kind = str | bool if name.startswith("StateTransitions") else int | float
        for path in (one["value"] for one in panel.get("paths", ())):
            values = found(records, path)
            assert values, path
            assert all(isinstance(value, kind) for value in values), path


def test_the_foxglove_layout_follows_frames_that_the_log_draws(records: list[Record]) -> None:
    drawn = {child.child_frame_id for one in records if one.topic == "/tf/cameras" for child in one.value.transforms}
    followed = {panel["followTf"] for panel in foxglove_layout()["configById"].values() if "followTf" in panel}
    assert drawn | {"room"} >= followed > {"room"}


def test_the_plotjuggler_layout_plots_only_series_that_the_log_holds(records: list[Record]) -> None:
    held = {name for record in records for name in series(record)}
    missing = set(curves()) - held
    assert not missing
