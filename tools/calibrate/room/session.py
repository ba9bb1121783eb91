"""One `posebridge calibrate room`: footage in; page and room file out."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from rich.console import Console

from bridge.settings import Settings, load_settings
from tools.calibrate.board import Board
from tools.calibrate.formats.convert import read_cameras
from tools.calibrate.room.file import Record, read_config, write_room
from tools.calibrate.room.footage import Footage, watch
from tools.calibrate.room.inspect import inspect
from tools.calibrate.room.report import to_json, to_text
from tools.calibrate.room.room import Terms, calibrate_room
from tools.calibrate.room.verdict import Verdict, judge
from tools.calibrate.room.worth import worth_of
from tools.colours.write import check_target
from tools.open_source import open_source
from tools.request import Clocks
from tools.screen import screen
from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.rig import Rig, make_rig
from tracker.types import Array, frozen_array

FRAMES = SPOTS, BOARD, CONFIG = ("spots", "board", "config")
STILLS = 8  # pictures of each camera in which the board is looked for
WAVE = "wave the marker through all of the room, tilted to all sides, for a minute"
STAND = "then set it down for 3 s on each of three level spots"


@dataclass(frozen=True, slots=True)
class RoomRequest:
    """One calibration. config: name or path.  source: URI.  intrinsics: files of cameras, none for the config's.

    frame: spots, board or config.  board: that lies on the floor, for `board`.  origin_mm: as typed.
    apart_mm: of the first two spots, None if not measured.  by: who measured.  seconds: of footage at most.
    out: the room file, None for none.
    """

    config: str
    source: str
    intrinsics: tuple[Path, ...]
    frame: str
    board: Board
    origin_mm: str
    apart_mm: float | None
    refine_intrinsics: bool
    by: str
    seconds: float
    out: Path | None
    overwrite: bool
    as_json: bool

    def __post_init__(self) -> None:
        """Refuse what no calibration can be made with, by OperatorError."""
        if self.frame not in FRAMES:
            raise OperatorError(f"--frame {self.frame!r}: unknown; known: {', '.join(FRAMES)}")
        if self.frame == BOARD and not self.board.tells_its_top:
            raise OperatorError(
                f"--corners {self.board.columns}x{self.board.rows}: such a chessboard looks alike from both ends; take "
                "a charuco, or one even and one odd number of corners"
            )
        if self.apart_mm is not None and self.frame != SPOTS:
            raise OperatorError(f"--apart_mm: is between spots, the frame is {self.frame}; leave it out")
        if self.apart_mm is not None and not 100.0 <= self.apart_mm <= 20_000.0:
            raise OperatorError(
                f"--apart_mm {self.apart_mm:g} mm: must be 100 to 20000 mm; measure the first two spots"
            )
        if not 5.0 <= self.seconds <= 600.0:
            raise OperatorError(f"--seconds {self.seconds:g} s: must be 5 to 600 s; a minute is plenty")

    def origin_m(self) -> Array:
        """Return where the marker is in the room on the first spot, or the board's first corner (3,) [m]."""
        parts = self.origin_mm.split(",")
        try:
            values = [float(part) for part in parts]
        except ValueError:
            values = []
        if len(values) != 3 or not np.isfinite(values).all():
            raise OperatorError(f"--origin_mm {self.origin_mm!r}: must be three millimetres, such as 0,0,-600")
        return 1e-3 * np.array(values)


def run_room(request: RoomRequest, clocks: Clocks) -> Verdict:
    """Look, solve, judge, show and write.

    Raises:
        OperatorError: bad input, or footage that tells nothing.
    """
    if request.out is not None:
        check_target(request.out, "--out", request.overwrite)
    origin_m, settings = request.origin_m(), load_settings(request.config)
    rig, footage = _watched(request, settings, clocks)
    inspect(footage, rig, request.source)
    apart_m = None if request.apart_mm is None else 1e-3 * request.apart_mm
    volume_m = 1e-3 * np.array(settings.room.volume_mm)
    board = request.board if request.frame == BOARD else None
    terms = Terms(request.frame == SPOTS, origin_m, apart_m, volume_m, request.refine_intrinsics, board)
    room = calibrate_room(footage, rig, terms)
    verdict = judge(room)
    if request.out is not None:
        day = str(datetime.fromtimestamp(clocks.wall() / 1e9, UTC).date())
        record = Record(day, request.by, request.source, request.frame)
        write_room(request.out, read_config(request.config), room.cameras, worth_of(room, verdict), record)
    sys.stdout.write((to_json(room, verdict) if request.as_json else to_text(room, verdict)) + "\n")
    return verdict


def _watched(request: RoomRequest, settings: Settings, clocks: Clocks) -> tuple[Rig, Footage]:
    """Open the source and look for the marker in its frames."""
    console = screen(stderr=True)
    with ExitStack() as stack:
        opened = open_source(request.source, settings, clocks)
        stack.enter_context(opened.source)
        rig = make_rig(_with_intrinsics(opened.chosen.rig.cameras, request.intrinsics), opened.chosen.rig.marker)
        if opened.live:
            steps = f"{WAVE}; {STAND}" if request.frame == SPOTS else WAVE
            _say(console, f"{steps}; Ctrl-C ends it, {request.seconds:g} s at most")
        stills = STILLS if request.frame == BOARD else 0
        footage = watch(opened.source, rig, request.seconds, lambda line: _say(console, line), stills)
    return rig, footage


def _with_intrinsics(cameras: tuple[Camera, ...], files: tuple[Path, ...]) -> tuple[Camera, ...]:
    """Return cameras with the lenses of files: by name where the names are the same, else in order."""
    if not files:
        return cameras
    lenses = [lens for file in files for lens in read_cameras(file)]
    if len(lenses) != len(cameras):
        raise OperatorError(
            f"--cameras: {len(lenses)} cameras in {len(files)} files, the rig has {len(cameras)}; name as many"
        )
    named = {lens.name: lens for lens in lenses}
    chosen = [named[c.name] for c in cameras] if set(named) == {c.name for c in cameras} else lenses
    return tuple(
        replace(
            camera, width_px=lens.width_px, height_px=lens.height_px, K=frozen_array(lens.K),
            distortion=frozen_array(lens.distortion),
        )
        for camera, lens in zip(cameras, chosen, strict=True)
    )  # fmt: skip


def _say(console: Console, line: str) -> None:
    console.print(f"posebridge: {line}", soft_wrap=True)
