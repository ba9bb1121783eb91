"""What is printed can be found again, at the size it says."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from tests.tools.test_cli import posebridge
from tools.calibrate.board import Board, BoardKind, make_board
from tools.calibrate.command import BoardRequest, print_board
from tools.calibrate.find import Finder
from tools.calibrate.sheet import MM_PER_INCH, Paper, draw_sheet, largest_square_mm
from tracker.errors import OperatorError
from tracker.types import Image

DPI = 150


def on_screen(board: Board, paper: Paper) -> Image:
    """Return the sheet as pixels, DPI to the inch."""
    held = io.BytesIO()
    draw_sheet(board, paper).savefig(held, format="png", dpi=DPI)
    image = cv2.imdecode(np.frombuffer(held.getvalue(), np.uint8), cv2.IMREAD_GRAYSCALE)
    assert image is not None
    return np.asarray(image, dtype=np.uint8)


@pytest.mark.parametrize("kind", list(BoardKind))
@pytest.mark.parametrize("paper", list(Paper))
def test_every_corner_is_found_where_the_board_has_it(kind: BoardKind, paper: Paper) -> None:
    board = make_board(kind, "9x6", largest_square_mm(paper, 9, 6))
    view = Finder(board).find(on_screen(board, paper), "sheet")
    assert view is not None
    assert list(view.ids) == list(range(54))
    expected_px = board.corners_m[:, :2] * 1e3 / MM_PER_INCH * DPI
    off_px = (view.uv_px - view.uv_px[0]) - (expected_px - expected_px[0])
    assert np.abs(off_px).max() < 1.0  # lines snap to whole pixels here, not in the PDF
    assert view.edge_px < 2.5


def test_the_command_writes_one_page_of_the_papers_size_without_pictures(tmp_path: Path) -> None:
    path = tmp_path / "board.pdf"
    done = posebridge("calibrate", "board", "--out", path)
    assert (done.returncode, done.stderr) == (0, "")
    assert "squares of 25 mm" in done.stdout
    content = path.read_bytes()
    box = re.search(rb"/MediaBox \[ ?([^\]]+)\]", content)
    assert box is not None
    assert [float(x) * MM_PER_INCH / 72 for x in box[1].split()] == pytest.approx([0, 0, 297, 210], abs=0.01)
    assert b"/Subtype /Image" not in content


@pytest.mark.parametrize(
    ("wrong", "complaint"),
    [
        ({"corners": "9"}, "must be two numbers"),
        ({"corners": "2x9"}, "must be 3 to 40"),
        ({"square_mm": 40.0}, "too large for A4"),
        ({"square_mm": -1.0}, "must be positive"),
        ({"marker_mm": 30.0}, "must be between 0 and the square's 25 mm"),
        ({"paper": "A5"}, "known: A4, A3"),
        ({"kind": "dots"}, "known: charuco, chessboard"),
        ({"dictionary": "9X9"}, "unknown; known:"),
        ({"corners": "20x12"}, "holds 50 markers, the board needs 136"),
    ],
)
def test_a_board_that_cannot_be_is_refused(wrong: dict[str, Any], complaint: str, tmp_path: Path) -> None:
    usual = BoardRequest(tmp_path / "a.pdf", "charuco", "9x6", "A4", None, None, "4X4_50", False)
    with pytest.raises(OperatorError, match=re.escape(complaint)):
        print_board(replace(usual, **wrong))
    assert not (tmp_path / "a.pdf").exists()
