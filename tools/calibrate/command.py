"""The small commands of `posebridge calibrate`: a board on paper, one file into another."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tools.calibrate.board import BoardKind, make_board, parse_pair
from tools.calibrate.formats.convert import FileFormat, format_of, read_cameras, write_cameras
from tools.calibrate.sheet import Paper, draw_sheet, largest_square_mm, write_sheet
from tools.colours.write import check_target
from tools.suffix import check_suffix
from tracker.errors import OperatorError


@dataclass(frozen=True, slots=True)
class BoardRequest:
    """One sheet. out: the PDF.  kind, corners, paper: as typed.  square_mm, marker_mm: None for what fits best."""

    out: Path
    kind: str
    corners: str
    paper: str
    square_mm: float | None
    marker_mm: float | None
    dictionary: str
    overwrite: bool


@dataclass(frozen=True, slots=True)
class ConvertRequest:
    """One conversion. to: the format's name, None to go by the file's.  size: as typed, None if the file tells."""

    file: Path
    out: Path
    to: str | None
    size: str | None
    overwrite: bool


def convert_file(request: ConvertRequest) -> list[str]:
    """Convert, and return what to say of it.

    Raises:
        OperatorError: no calibration, one that cannot be represented, or a file that cannot be written.
    """
    into = format_of(request.to, request.out)
    size_px = None if request.size is None else parse_pair(request.size, "--size", "pixels")
    cameras = read_cameras(request.file, size_px)
    if len(cameras) > 1 and into in (FileFormat.ROS, FileFormat.EUROC):
        if request.out.exists() and not request.overwrite:
            raise OperatorError(f"{request.out}: exists already; name another, or give --overwrite")
    else:
        check_target(request.out, "OUT", request.overwrite)
    lost = write_cameras(cameras, request.out, into)
    names = ", ".join(camera.name for camera in cameras)
    return [f"{request.out}: {into}, {names}", *([f"warning: not in this format: {lost}"] if lost else [])]


def print_board(request: BoardRequest) -> str:
    """Write the sheet and return what to say of it.

    Raises:
        OperatorError: a board that is none or does not fit, a file that is no PDF by its name or cannot be written.
    """
    check_suffix(request.out, "--out", ".pdf")
    check_target(request.out, "--out", request.overwrite)
    kind, paper = kind_of(request.kind), _paper_of(request.paper)
    trial = make_board(kind, request.corners, request.square_mm or 1.0, None, request.dictionary)
    square_mm = request.square_mm
    if square_mm is None:
        square_mm = largest_square_mm(paper, trial.columns, trial.rows)
    board = make_board(kind, request.corners, square_mm, request.marker_mm, request.dictionary)
    write_sheet(draw_sheet(board, paper), request.out)
    return (
        f"{request.out}: {board}, {paper} lying; print at 100 %, check the ruler, glue it on something flat and stiff, "
        "then\n"
        f"  posebridge calibrate intrinsics --board {kind} --corners {request.corners} --square_mm {square_mm:g} ..."
    )


def kind_of(text: str) -> BoardKind:
    """Return the kind of board.

    Raises:
        OperatorError: there is none of that name.
    """
    if text.lower() not in set(BoardKind):
        raise OperatorError(f"--board {text!r}: unknown; known: {', '.join(BoardKind)}")
    return BoardKind(text.lower())


def _paper_of(text: str) -> Paper:
    if text.upper() not in set(Paper):
        raise OperatorError(f"--paper {text!r}: unknown; known: {', '.join(Paper)}")
    return Paper(text.upper())
