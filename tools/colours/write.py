"""The learned colours, put into a copy of the config that keeps everything else."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import tomlkit
from tomlkit.exceptions import TOMLKitError

from tracker.errors import OperatorError
from tracker.rig import Colour


def check_target(path: Path, what: str, overwrite: bool) -> None:
    """Find out before the footage is read that a file could not be written after it.

    Raises:
        OperatorError: a directory, one in no directory, or a file that exists and may not be replaced.
    """
    if path.is_dir():
        raise OperatorError(f"{what} {path}: is a directory; name a file in it")
    if not path.resolve().parent.is_dir():
        raise OperatorError(f"{what} {path}: the directory {path.parent} does not exist; create it")
    if path.exists() and not overwrite:
        raise OperatorError(f"{what} {path}: exists already; name another, or give --overwrite")


def recoloured(text: str, colours: Mapping[str, Colour], folder: Path, new_folder: Path) -> str:
    """Return a config's text with other colours, comments and all else as they were.

    Args:
        text: the config, TOML.
        colours: by ball.
        folder, new_folder: where it was read and where it goes; a relative calibration is made to lead to the same
            place.
    Raises:
        OperatorError: text that is no TOML.
    """
    try:
        document = tomlkit.parse(text)
    except TOMLKitError as error:
        raise OperatorError(f"config: not TOML: {error}; correct that line") from error
    table = document.unwrap()
    for k, ball in enumerate(table["marker"]["balls"]):
        colour = colours[ball["name"]]
        here = document["marker"]["balls"][k]  # type of tomlkit's own; a table or an inline one
        here["hue_deg"] = colour.hue_deg
        here["hue_tolerance_deg"] = colour.hue_tolerance_deg
        here["saturation_min"] = colour.saturation_min
        here["value_min"] = colour.value_min
        here["bgr"] = list(colour.bgr)
    calibration = table["rig"].get("calibration", "")
    if calibration and not Path(calibration).expanduser().is_absolute():
        moved = os.path.relpath((folder / calibration).resolve(), new_folder.resolve())
        if Path(moved) != Path(calibration):
            document["rig"]["calibration"] = moved
    return tomlkit.dumps(document)


def write_config(path: Path, text: str) -> None:
    """Write a config.

    Raises:
        OperatorError: it cannot be written.
    """
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise OperatorError(f"--write {path}: cannot be written ({error.strerror}); name a writable path") from error
