"""The shipped layouts, read as their viewers read them: what of a log they name, and what it is called there."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import config
from bridge.log.reader import Record

FOLDER = Path(config.__file__).parent
FOXGLOVE, PLOTJUGGLER = FOLDER / "posebridge-layout.json", FOLDER / "plotjuggler-layout.xml"
PANELS = {"3D", "Image", "Plot", "RosOut", "StateTransitions"}
_STEP = re.compile(r'\.(\w+)|\[(\d+|:)\]|\{(\w+)=="(\w+)"\}')


def foxglove_layout() -> dict[str, Any]:
    """Return the layout that Foxglove and Lichtblick import."""
    layout: dict[str, Any] = json.loads(FOXGLOVE.read_text(encoding="utf-8"))
    return layout


def shown(node: Any) -> Iterator[str]:
    """Yield the panels that a part of its window shows."""
    if isinstance(node, str):
        yield node
    else:
        yield from shown(node["first"])
        yield from shown(node["second"])


def named_topics(panel: dict[str, Any]) -> set[str]:
    """Return the topics that a panel shows whole."""
    image = {value for key, value in panel.get("imageMode", {}).items() if key.endswith("Topic")}
    return image | set(panel.get("topics", ())) | {panel[key] for key in ("topicToRender",) if key in panel}


def found(records: list[Record], path: str) -> list[Any]:
    """Return the values that a message path leads to: `/topic.field[0]`, `[:]` for all, `{name=="x"}` for some."""
    topic, dot, steps = path.partition(".")
    return [value for record in records if record.topic == topic for value in _follow(record.value, dot + steps)]


def _follow(message: Any, steps: str) -> list[Any]:
    values = [message]
    for name, index, key, wanted in _STEP.findall(steps):
        if name:
            values = [value[name] for value in values if name in value]
        elif index == ":":
            values = [item for value in values for item in value]
        elif index:
            values = [value[int(index)] for value in values if len(value) > int(index)]
        else:
            values = [value for value in values if value[key] == wanted]
    return values


def curves() -> list[str]:
    """Return the series that PlotJuggler's layout plots."""
    return [element.attrib["name"] for element in ElementTree.parse(PLOTJUGGLER).iter("curve")]


def series(record: Record) -> Iterator[str]:
    """Yield the names that PlotJuggler gives to the numbers of a JSON message: its parser leaves out text and null."""
    return _flattened(record.topic, record.value)


def _flattened(name: str, value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _flattened(f"{name}/{key}", inner)
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from _flattened(f"{name}[{index}]", inner)
    elif isinstance(value, int | float):
        yield name
