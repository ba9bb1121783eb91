"""The room file: a copy of the config with measured cameras, and how good they are. All else stays as it was."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tomlkit

from bridge.settings import shipped_configs
from tools.calibrate.formats.fields import write_text
from tools.calibrate.formats.own import camera_table
from tools.calibrate.room.room import Room
from tools.calibrate.room.verdict import Verdict
from tracker.errors import OperatorError

NOMINAL = re.compile(r"^# (Nominal cameras|Drawn by posebridge place)[^\n]*\n(#[^\n]*\n)*", re.MULTILINE)
FROM_ELSEWHERE = {"calibration": ""}  # the cameras stand in the file itself


@dataclass(frozen=True, slots=True)
class Record:
    """Who measured what, and when. on: the day.  by: who.  source: the footage.  frame: spots or config."""

    on: str
    by: str
    source: str
    frame: str


def write_room(path: Path, config: str, room: Room, verdict: Verdict, record: Record) -> None:
    """Write the room file, ready for `posebridge run --config`.

    Raises:
        OperatorError: the config cannot be read any more, or the file cannot be written.
    """
    origin = shipped_configs().get(config, Path(config))
    try:
        text = origin.read_text(encoding="utf-8")
    except OSError as error:
        raise OperatorError(f"config {origin}: cannot be read ({error.strerror}); name one that is there") from error
    write_text(path, with_room(text, room, verdict, record))


def with_room(text: str, room: Room, verdict: Verdict, record: Record) -> str:
    """Return a config's text with a room's cameras; what it says of live cameras, and its comments, stay."""
    document = tomlkit.parse(NOMINAL.sub("", text))
    rig = document["rig"]
    known = {str(table["name"]): table for table in rig.get("cameras", [])}
    tables = tomlkit.aot()
    for camera in room.cameras:
        new, old = camera_table(camera), known.get(camera.name)
        if old is None:
            tables.append(new)
            continue
        old.update(new)
        if "clock_offset_ms" in old:
            old["clock_offset_ms"] = camera.clock_offset_ns / 1e6
        tables.append(old)
    measured = _measured(room, verdict, record)
    rig.pop("cameras", None)
    rig.pop("measured", None)
    rig.update(FROM_ELSEWHERE)
    rig.add("measured", measured)
    rig.add("cameras", tables)
    return re.sub(r"\n{3,}", "\n\n", tomlkit.dumps(document))  # tables that were moved bring their blank lines along


def _measured(room: Room, verdict: Verdict, record: Record) -> tomlkit.items.Table:
    """Return [rig.measured]."""
    table = tomlkit.table()
    table.add(tomlkit.comment("Written by `posebridge calibrate room`: where the cameras below come from, and their"))
    table.add(tomlkit.comment("worth. Errors of held out footage; one sigma of a point by the cameras' places; see"))
    table.add(tomlkit.comment("docs/room.md. While this table is here, these cameras count before a recording's own."))
    for key, value in (
        ("on", record.on), ("by", record.by), ("source", record.source), ("verdict", str(verdict.grade)),
        ("reasons", [*verdict.against, *verdict.doubts]), ("frame", record.frame),
        ("point_mm", _round(room.volume.point_mm)), ("worst_point_mm", _round(room.volume.worst_point_mm)),
        ("spacing_mm", _round(room.held_out.spacing_mm)), ("spacing_95_mm", _round(room.held_out.worst_spacing_mm)),
        ("reprojection_px", _round(room.held_out.reprojection_px)),
        ("epipolar_px", _round(room.held_out.epipolar_px)),
    ):  # fmt: skip
        table.add(key, value)
    cameras = tomlkit.aot()
    for c, camera in enumerate(room.cameras):
        one = tomlkit.table()
        one.add("name", camera.name)
        one.add("position_sigma_mm", [_round(x) for x in room.position_mm(c)])
        one.add("attitude_sigma_deg", [_round(x) for x in room.attitude_deg(c)])
        one.add("clock_sigma_ms", _round(room.clock_ms(c)))
        cameras.append(one)
    table.add("cameras", cameras)
    return table


def _round(value: float) -> float:
    """Keep what a sigma is worth; -1 where nothing could be measured."""
    return round(float(value), 4) if np.isfinite(value) else -1.0
