"""What the command line was asked to do, and the clocks it does it by."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING

from tracker.errors import OperatorError

if TYPE_CHECKING:  # only a name here: a mistyped option should not wait for pydantic
    from bridge.settings import Settings

SHORTEST_DEMO_S, LONGEST_DEMO_S = 15.0, 3600.0  # every phase of the mission needs its time


class Pace(StrEnum):
    """How fast a source that is not live runs."""

    REAL = "real"
    FAST = "fast"


class FrameFormat(StrEnum):
    """How a log keeps frames: the names of `bridge.log.film`, which loads OpenCV."""

    JPEG = "jpeg"
    PNG = "png"


class ExportFormat(StrEnum):
    """What a log can be written as."""

    TUM = "tum"
    CSV = "csv"
    PARQUET = "parquet"
    MAT = "mat"
    TLOG = "tlog"


@dataclass(frozen=True, slots=True)
class Clocks:
    """The real clocks, taken by the command line alone.

    monotonic: the host's monotonic clock, the time base of live frames [ns].  stopwatch: measures durations [ns].
    wall: the calendar's time, only ever written beside the monotonic one in the log [ns].
    sleep_s: waits [s].
    """

    monotonic: Callable[[], int]
    stopwatch: Callable[[], int]
    wall: Callable[[], int]
    sleep_s: Callable[[float], None]


@dataclass(frozen=True, slots=True)
class CpuClocks:
    """Reads the CPU time of the whole process, and of the calling thread [ns]."""

    process: Callable[[], int]
    thread: Callable[[], int]


@dataclass(frozen=True, slots=True)
class RunRequest:
    """One run. source: the URI as given.  log, summary: files to write, None for none.  config: the file gone by."""

    settings: Settings
    source: str
    log: Path | None
    pace: Pace
    summary: Path | None
    overwrite: bool
    quiet: bool
    config: Path | None = None


@dataclass(frozen=True, slots=True)
class DemoRequest:
    """One demo flight of `duration_s` [s]; its files go to the folder `out`, its frames into the log if wanted.

    Raises:
        OperatorError: a duration outside 15 to 3600 s, or a negative seed.
    """

    duration_s: float
    seed: int
    out: Path
    pace: Pace
    frames: FrameFormat | None = None

    def __post_init__(self) -> None:
        if not (math.isfinite(self.duration_s) and SHORTEST_DEMO_S <= self.duration_s <= LONGEST_DEMO_S):
            raise OperatorError(
                f"--duration_s: {self.duration_s:g} s must be {SHORTEST_DEMO_S:g} to {LONGEST_DEMO_S:g} s; "
                "give a length within"
            )
        if self.seed < 0:
            raise OperatorError(f"--seed: {self.seed} must be 0 or more; give another number")
