"""What many tests need: the recordings."""

from __future__ import annotations

import importlib
import importlib.util
import os
from pathlib import Path
from typing import Any, NoReturn

import pytest
from hypothesis import settings

# How long an example takes is the machine's affair, not the property's.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

REPOSITORY = Path(__file__).resolve().parent.parent


def _lacking(what: str) -> NoReturn:
    """Fail in CI, skip elsewhere, for a part that a test needs."""
    if os.environ.get("CI") == "true":
        pytest.fail(what)
    pytest.skip(what)


@pytest.fixture(scope="session")
def shared() -> Path:
    """Return the folder of recordings: POSEBRIDGE_SHARED, or `shared` beside the repository.

    In CI a missing folder is a failure; on a user's machine the tests that need it are skipped.
    """
    folder = Path(os.environ.get("POSEBRIDGE_SHARED", REPOSITORY.parent / "shared"))
    if not (folder / "recordings").is_dir():
        missing = f"no recordings in {folder}: set POSEBRIDGE_SHARED to the folder that holds `recordings`"
        _lacking(missing)
    return folder


@pytest.fixture(scope="session")
def chessboard_pairs(shared: Path) -> Path:
    """Return the folder of real stereo chessboard pairs; lacking, it fails in CI and skips on a user's machine."""
    folder = shared / "chessboard-stereo"
    if not folder.is_dir():
        _lacking(f"no chessboard pairs in {folder}")
    return folder


@pytest.fixture(scope="session")
def full_disk() -> Path:
    """Return a file on a disk that is always full; one that is lacking fails in CI and skips on a user's machine."""
    device = Path("/dev/full")
    if not device.is_char_device():
        _lacking(f"this system has no {device}")
    return device


@pytest.fixture(scope="session")
def mavproxy() -> None:
    """See that MAVProxy is there; without it a test fails in CI and skips on a user's machine."""
    if importlib.util.find_spec("MAVProxy") is None:
        _lacking("MAVProxy is not installed; `make venv` does that")


@pytest.fixture(scope="session")
def mavsdk() -> Any:
    """Return the module of MAVSDK; without it a test fails in CI and skips on a user's machine."""
    try:
        return importlib.import_module("mavsdk")
    except (ImportError, OSError) as error:
        _lacking(f"MAVSDK is not installed ({error}); `make venv` does that")


@pytest.fixture(scope="session")
def lab_protocol(shared: Path) -> Path:
    """Return the recording of the paper's protocol: 38 pairs, PNG."""
    return shared / "recordings" / "lab-protocol"


@pytest.fixture(scope="session")
def lab_flight(shared: Path) -> Path:
    """Return the recording of a flight: 90 pairs at 15 Hz, JPEG, motion blur, balls partly hidden."""
    return shared / "recordings" / "lab-flight"


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Without ARDUPILOT_SITL: leave `sitl` tests out in CI, which has no such program, and skip them elsewhere.

    CI still flies the same plan on the project's simulated autopilot, in a test that needs no program.
    """
    if os.environ.get("ARDUPILOT_SITL"):
        return
    wanting = [item for item in items if item.get_closest_marker("sitl")]
    if os.environ.get("CI") == "true":
        config.hook.pytest_deselected(items=wanting)
        items[:] = [item for item in items if item not in wanting]
    for item in wanting:
        item.add_marker(pytest.mark.skip(reason="set ARDUPILOT_SITL to ArduPilot's SITL program; see docs/sitl.md"))
