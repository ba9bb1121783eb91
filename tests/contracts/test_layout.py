"""The shipped viewer layout names only what a log of ours holds."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega

import config
from bridge.log.film import MEGABYTE, FilmTerms, FrameFormat
from bridge.log.reader import LogReader
from tests.bridge.recordings import recorder, turns
from tracker.types import Frame

LAYOUT = Path(config.__file__).with_name("posebridge-layout.json")
MAVLINK = re.compile(r"/mavlink/(sent|received)/(\w+)\.fields\.(\w+)$")
PANELS = {"3D", "Image", "Plot", "RosOut"}


@pytest.fixture(scope="module")
def layout() -> dict[str, Any]:
    content: dict[str, Any] = json.loads(LAYOUT.read_text(encoding="utf-8"))
    return content


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return one message of each topic of a log with frames."""
    path = tmp_path_factory.mktemp("log") / "a.mcap"
    with recorder(path, film=FilmTerms(FrameFormat.JPEG, MEGABYTE)) as log:
        for k, (frame, step, sent, now_ns) in enumerate(turns(4)):
            assert isinstance(frame, Frame)
            picture = Frame(k % 2, frame.t_ns, np.zeros((8, 8, 3), np.uint8))
            log.take(picture, step, sent, now_ns)
    return {record.topic: record.value for record in LogReader(path).records()}


def plotted(layout: dict[str, Any]) -> Iterator[str]:
    for name, panel in layout["configById"].items():
        if name.startswith("Plot!"):
            yield from (path["value"] for path in panel["paths"])


def leaves(node: Any) -> Iterator[str]:
    if isinstance(node, str):
        yield node
    else:
        yield from leaves(node["first"])
        yield from leaves(node["second"])


def follow(value: Any, steps: list[str]) -> Any:
    """Return what a message path leads to."""
    for step in steps:
        name, _, index = step.partition("[")
        value = value[name] if isinstance(value, dict) else getattr(value, name)
        if index:
            value = value[0 if index == ":]" else int(index[:-1])]
    return value


def test_every_panel_is_shown_once_and_of_a_kind_that_viewers_have(layout: dict[str, Any]) -> None:
    assert sorted(leaves(layout["layout"])) == sorted(layout["configById"])
    assert {name.partition("!")[0] for name in layout["configById"]} == PANELS


def test_every_topic_of_a_panel_is_in_a_log(layout: dict[str, Any], samples: dict[str, Any]) -> None:
    named = set()
    for panel in layout["configById"].values():
        named |= set(panel.get("topics", ())) | {panel[key] for key in ("topicToRender",) if key in panel}
        named |= {value for key, value in panel.get("imageMode", {}).items() if key.endswith("Topic")}
    assert len(named) >= 7
    assert named <= set(samples)


def test_every_plotted_field_is_a_number_in_a_log_or_a_field_of_that_mavlink_message(
    layout: dict[str, Any], samples: dict[str, Any]
) -> None:
    paths = list(plotted(layout))
    assert len(paths) >= 12
    for path in paths:
        message = MAVLINK.match(path)
        if message is not None:
            kind = getattr(ardupilotmega, f"MAVLink_{message[2].lower()}_message")
            assert message[3] in kind.fieldnames, path
            continue
        topic, *steps = path.split(".")
        assert isinstance(follow(samples[topic], steps), int | float), path


def test_the_frames_it_follows_are_drawn(layout: dict[str, Any], samples: dict[str, Any]) -> None:
    frames = {"room", "body"} | {one.child_frame_id for one in samples["/tf/cameras"].transforms}
    followed = {panel["followTf"] for panel in layout["configById"].values() if "followTf" in panel}
    assert followed
    assert followed <= frames
