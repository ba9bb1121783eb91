"""One `posebridge calibrate intrinsics`: pictures in; page, plot and file out."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console

from bridge.settings import load_settings
from tools.calibrate.board import Board
from tools.calibrate.find import Finder, View
from tools.calibrate.footage import Footage, Instant, open_footage
from tools.calibrate.formats.convert import format_of, write_cameras
from tools.calibrate.formats.poses import placed
from tools.calibrate.intrinsics import FLAGS
from tools.calibrate.picture import draw_calibration
from tools.calibrate.report import to_json, to_text
from tools.calibrate.result import Calibration, calibrate_all
from tools.calibrate.views import CELLS, Gathering, where_to_go
from tools.colours.write import check_target
from tools.request import Clocks
from tools.screen import screen
from tools.suffix import check_suffix
from tracker.errors import OperatorError

ENOUGH_VIEWS, ENOUGH_COVERAGE = 30, 0.85  # of a live camera: it stops by itself
SMALLEST_IMAGE_PX = 32


@dataclass(frozen=True, slots=True)
class IntrinsicsRequest:
    """One calibration. source: URI, or images:GLOB.  out, picture: files, None for none.  to: the format of `out`.

    coefficients: of distortion.  distance_m: from a camera to where is flown [m].
    """

    config: str
    source: str
    board: Board
    coefficients: int
    distance_m: float
    out: Path | None
    to: str | None
    picture: Path | None
    overwrite: bool
    as_json: bool

    def __post_init__(self) -> None:
        """Refuse what no calibration can be made with, by OperatorError."""
        if self.coefficients not in FLAGS:
            raise OperatorError(f"--coefficients {self.coefficients}: must be 4, 5 or 8 (k1 k2 p1 p2 [k3 [k4 k5 k6]])")
        if not 0.0 < self.distance_m < 1000.0:
            raise OperatorError(f"--distance_m {self.distance_m:g} m: must be between 0 and 1000 m; measure it")


def run_intrinsics(request: IntrinsicsRequest, clocks: Clocks) -> Calibration:
    """Look, choose, fit, judge, show and write.

    Raises:
        OperatorError: bad input, or no board in it.
    """
    into = None if request.out is None else format_of(request.to, request.out)
    for path, option in ((request.out, "--out"), (request.picture, "--picture")):
        if path is not None:
            check_target(path, option, request.overwrite)
    check_suffix(request.picture, "--picture", ".png")
    footage = open_footage(request.source, load_settings(request.config), clocks)
    gathering = look(footage, request)
    result = calibrate_all(footage.names, gathering, request.board, request.coefficients, request.distance_m)
    if request.out is not None and into is not None:
        day = datetime.fromtimestamp(clocks.wall() / 1e9, UTC).date()
        remarks = (f"Calibrated on {day} from {request.source} with a {request.board}.", *_remarks(result))
        write_cameras(result.rig(), request.out, into, remarks)
    if request.picture is not None:
        draw_calibration(result, request.picture)
    sys.stdout.write((to_json(result) if request.as_json else to_text(result)) + "\n")
    return result


def _remarks(result: Calibration) -> list[str]:
    """Say in the file itself what its values are worth."""
    remarks = [
        f"{camera.name}: {len(camera.views)} views, error {camera.lens.rms_px:.3f} px, held out "
        f"{camera.held_out.rms_px:.3f} px" + ("" if verdict.good else "; NOT GOOD: " + "; ".join(verdict.against))
        for camera, verdict in zip(result.cameras, result.verdicts, strict=True)
    ]
    for pair, verdict in result.pairs:
        said = "" if verdict.good else "; NOT GOOD: " + "; ".join(verdict.against)
        remarks.append(f"{' and '.join(pair.names)}: {len(pair.errors_px)} pairs, error {pair.rms_px:.3f} px{said}")
    if placed(result.rig()):
        remarks.append(
            f"Poses are in {result.cameras[0].name}'s frame, z along its axis: NOT the room's, not for flight."
        )
    return remarks


def look(footage: Footage, request: IntrinsicsRequest) -> Gathering:
    """Find the board in every picture; a live source goes on until it is enough, or until it is interrupted.

    Raises:
        OperatorError: no sharp view of the board at all, or pictures of two sizes.
    """
    console = screen(stderr=True)
    for warning in footage.warnings:
        console.print(f"posebridge: warning: {warning}", style="yellow", soft_wrap=True)
    finder = Finder(request.board)
    gathering = Gathering({}, footage.chosen)
    if footage.live:
        _say(console, f"show the {request.board}, still, near and far, in every corner, tilted; Ctrl-C ends it")
    with footage.opened:
        try:
            for instant in footage.instants:
                taken = gathering.take(_found(finder, instant, gathering, footage.names))
                if taken and footage.live:
                    _say(console, _progress(gathering, footage.names))
                    if _enough(gathering, len(footage.names)):
                        break
        except KeyboardInterrupt:
            if not footage.live:
                raise
    if not gathering.kept:
        blurred = f", {gathering.blurred} blurred" if gathering.blurred else ""
        raise OperatorError(
            f"source {request.source}: no sharp view of a {request.board} in {gathering.count} pictures{blurred}; "
            "check --board, --corners and --dictionary, the whole board must be seen, white paper round it"
        )
    return gathering


def _found(finder: Finder, instant: Instant, gathering: Gathering, names: tuple[str, ...]) -> dict[int, View | None]:
    found: dict[int, View | None] = {}
    for camera, picture in instant.items():
        height, width = picture.image.shape[:2]
        known = gathering.sizes_px.setdefault(camera, (width, height))
        if known != (width, height):
            raise OperatorError(
                f"{names[camera]}, {picture.name}: {width} x {height} px, those before it {known[0]} x "
                f"{known[1]} px; a calibration is of one size"
            )
        if min(width, height) >= SMALLEST_IMAGE_PX:
            found[camera] = finder.find(picture.image, picture.name, picture.t_ns)
    return found


def _progress(gathering: Gathering, names: tuple[str, ...]) -> str:
    """Say how much of each camera's picture has had the board, and where to go on."""
    parts = []
    for k, name in enumerate(names):
        if k not in gathering.sizes_px:
            continue
        counts = gathering.coverage(k)
        had = f"{name} {len(gathering.of(k))} views, {100 * (counts > 0).mean():.0f} % of {CELLS[0]} x {CELLS[1]}"
        parts.append(f"{had}, next: {where_to_go(counts)}")
    return "   ".join(parts)


def _enough(gathering: Gathering, camera_count: int) -> bool:
    return (
        all(
            len(gathering.of(k)) >= ENOUGH_VIEWS and (gathering.coverage(k) > 0).mean() >= ENOUGH_COVERAGE
            for k in range(camera_count)
            if k in gathering.sizes_px
        )
        and len(gathering.sizes_px) == camera_count
    )


def _say(console: Console, line: str) -> None:
    console.print(f"posebridge: {line}", soft_wrap=True)
