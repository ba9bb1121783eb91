"""The room file: a copy of the config with measured cameras, and how good they are. All else stays as it was."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tomlkit

from bridge.settings import config_path
from tools.calibrate.formats.fields import write_text
from tools.calibrate.formats.own import camera_table
from tools.calibrate.room.worth import Worth
from tracker.camera import Camera
from tracker.errors import OperatorError

NOMINAL = re.compile(r"^# (Nominal cameras|Drawn by posebridge place)[^\n]*\n(#[^\n]*\n)*", re.MULTILINE)
FROM_ELSEWHERE = {"calibration": ""}  # the cameras stand in the file itself


@dataclass(frozen=True, slots=True)
class Record:
    """Who measured what, and when. on: the day.  by: who.  source: the footage.  frame: spots, board or config.

    command: which of ours measured it.  manual: where it is explained.
    """

    on: str
    by: str
    source: str
    frame: str
    command: str = "calibrate room"
    manual: str = "docs/room.md"


def read_config(config: str) -> str:
    """Return the text of a config, by its name or path.

    Raises:
        OperatorError: it cannot be read.
    """
    origin = config_path(config)
    try:
        return origin.read_text(encoding="utf-8")
    except OSError as error:
        raise OperatorError(f"config {origin}: cannot be read ({error.strerror}); name one that is there") from error


def write_room(path: Path, text: str, cameras: Sequence[Camera], worth: Worth, record: Record) -> None:
    """Write the room file, ready for `posebridge run --config`.

    Args:
        text: the config's; all that is not of the cameras stays.
    Raises:
        OperatorError: the file cannot be written.
    """
    write_text(path, with_room(text, cameras, worth, record))


def with_room(text: str, cameras: Sequence[Camera], worth: Worth, record: Record) -> str:
    """Return a config's text with a room's cameras; what it says of live cameras, and its comments, stay."""
    document = tomlkit.parse(NOMINAL.sub("", text))
    rig = document["rig"]
    known = {str(table["name"]): table for table in rig.get("cameras", [])}
    tables = tomlkit.aot()
    for camera in cameras:
        new, old = camera_table(camera), known.get(camera.name)
        if old is None:
            new.add(tomlkit.nl())
            tables.append(new)
            continue
        old.update(new)
        if "clock_offset_ms" in old:
            old["clock_offset_ms"] = camera.clock_offset_ns / 1e6
        tables.append(old)
    measured = _measured(worth, record)
    rig.pop("cameras", None)
    rig.pop("measured", None)
    rig.update(FROM_ELSEWHERE)
    rig.add("measured", measured)
    rig.add("cameras", tables)
    return re.sub(r"\n{3,}", "\n\n", tomlkit.dumps(document))  # tables that were moved bring their blank lines along


def _measured(worth: Worth, record: Record) -> tomlkit.items.Table:
    """Return [rig.measured]."""
    table = tomlkit.table()
    for line in (
        f"Written by `posebridge {record.command}`: where the cameras below come from, and their",
        "worth. Errors of what was held out; one sigma of a point by the cameras' places; see",
        f"{record.manual}. While this table is here, these cameras count before a recording's own.",
    ):
        table.add(tomlkit.comment(line))
    for key, value in (
        ("on", record.on), ("by", record.by), ("source", record.source), ("verdict", str(worth.grade)),
        ("reasons", list(worth.reasons)), ("frame", record.frame),
        ("point_mm", _round(worth.point_mm)), ("worst_point_mm", _round(worth.worst_point_mm)),
        ("spacing_mm", _round(worth.spacing_mm)), ("spacing_95_mm", _round(worth.worst_spacing_mm)),
        ("reprojection_px", _round(worth.reprojection_px)), ("epipolar_px", _round(worth.epipolar_px)),
    ):  # fmt: skip
        table.add(key, value)
    cameras = tomlkit.aot()
    for camera in worth.cameras:
        one = tomlkit.table()
        one.add("name", camera.name)
        one.add("position_sigma_mm", [_round(x) for x in camera.position_sigma_mm])
        one.add("attitude_sigma_deg", [_round(x) for x in camera.attitude_sigma_deg])
        one.add("clock_sigma_ms", _round(camera.clock_sigma_ms))
        cameras.append(one)
    table.add("cameras", cameras)
    return table


def _round(value: float) -> float:
    """Keep what a sigma is worth; -1 where nothing could be measured."""
    return round(float(value), 4) if np.isfinite(value) else -1.0
