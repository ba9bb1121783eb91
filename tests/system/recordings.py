"""Short recordings to spoil, and the command as a process of its own."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
LINK = "udpout:127.0.0.1:14590"


def short_copy(recording: Path, directory: Path, pairs: int) -> Path:
    """Copy the first pairs of a recording, with its calibration and ground truth."""
    for folder in sorted((recording / "mav0").iterdir()):
        copy = directory / "mav0" / folder.name
        (copy / "data").mkdir(parents=True)
        if (folder / "sensor.yaml").exists():
            shutil.copy(folder / "sensor.yaml", copy)
        lines = (folder / "data.csv").read_text(encoding="utf-8").splitlines(keepends=True)
        if folder.name.startswith("cam"):
            lines = lines[: pairs + 1]
            for line in lines[1:]:
                name = line.split(",")[1].strip()
                shutil.copy(folder / "data" / name, copy / "data")
        (copy / "data.csv").write_text("".join(lines), encoding="utf-8")
    return directory


def images(directory: Path, camera: int) -> list[Path]:
    """Return a camera's images in order of time."""
    return sorted((directory / "mav0" / f"cam{camera}" / "data").iterdir())


def command(*arguments: str | Path) -> list[str]:
    """Return the arguments of `posebridge run` as a process."""
    return [sys.executable, "-m", "tools", "run", *map(str, arguments)]


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Run `posebridge run` to its end."""
    return posebridge("run", *arguments)


def posebridge(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Run the command line to its end."""
    return subprocess.run(
        [sys.executable, "-m", "tools", *map(str, arguments)],
        cwd=ROOT, env=os.environ | {"COLUMNS": "100"}, capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip


def summary_of(path: Path) -> dict[str, Any]:
    """Read a summary."""
    read: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return read
