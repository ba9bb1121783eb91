"""A short recording, for tests to spoil."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

PAIRS = 3


@pytest.fixture
def recording(lab_protocol: Path, tmp_path: Path) -> Path:
    """Return a copy of the first pairs of a recording, for tests to spoil."""
    copy = tmp_path / "copy"
    for camera in ("cam0", "cam1"):
        source, target = lab_protocol / "mav0" / camera, copy / "mav0" / camera
        (target / "data").mkdir(parents=True)
        shutil.copy(source / "sensor.yaml", target)
        lines = (source / "data.csv").read_text().splitlines()[: PAIRS + 1]
        (target / "data.csv").write_text("\n".join(lines) + "\n")
        for line in lines[1:]:
            shutil.copy(source / "data" / line.split(",")[1], target / "data")
    truth = Path("mav0") / "state_groundtruth_estimate0"
    shutil.copytree(lab_protocol / truth, copy / truth)
    return copy
