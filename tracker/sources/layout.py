"""Where things lie in a recording in EuRoC/ASL layout."""

from __future__ import annotations

import re
from pathlib import Path

from tracker.errors import OperatorError
from tracker.rig import MAX_CAMERAS, MIN_CAMERAS

_CAMERA_FOLDER = re.compile(r"cam(\d+)")


def find_mav0(directory: Path) -> Path:
    """Return the folder that holds cam0, cam1, ...: `directory/mav0`, or `directory` itself.

    Raises:
        OperatorError: no such directory, or none of the layout in it.
    """
    if not directory.is_dir():
        raise OperatorError(f"recording {directory}: no such directory; give the folder that holds mav0")
    if (directory / "mav0").is_dir():
        return directory / "mav0"
    if (directory / "cam0").is_dir():
        return directory
    raise OperatorError(
        f"recording {directory}: holds neither mav0 nor cam0; give the folder that holds mav0 (EuRoC/ASL layout)"
    )


def camera_folders(mav0: Path) -> tuple[Path, ...]:
    """Return the cameras' folders in order of their number.

    Raises:
        OperatorError: fewer than two or more than eight.
    """
    numbered = {
        int(match[1]): folder
        for folder in mav0.iterdir()
        if folder.is_dir() and (match := _CAMERA_FOLDER.fullmatch(folder.name))
    }
    folders = tuple(numbered[number] for number in sorted(numbered))
    if not MIN_CAMERAS <= len(folders) <= MAX_CAMERAS:
        raise OperatorError(
            f"recording {mav0}: {len(folders)} cameras; {MIN_CAMERAS} to {MAX_CAMERAS} work; "
            "each needs its folder cam0, cam1, ..."
        )
    return folders
