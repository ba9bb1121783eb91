"""The small commands of `posebridge calibrate`: a board on paper."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tools.calibrate.board import BoardKind, make_board
from tools.calibrate.sheet import Paper, draw_sheet, largest_square_mm, write_sheet
from tools.colours.write import check_target
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


def print_board(request: BoardRequest) -> str:
    """Write the sheet and return what to say of it.

    Raises:
        OperatorError: a board that is none or does not fit, or a file that cannot be written.
    """
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
