"""A calibration board: what is printed on it, and where its corners lie."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np

from tracker.errors import OperatorError
from tracker.types import Array

MARKER_SHARE = 0.75  # of a square's side: with 4 x 4 bits and their border the paper's grid is then 8 to a square
FEWEST_CORNERS, MOST_CORNERS = 3, 40


class BoardKind(StrEnum):
    """What is printed: a chessboard with or without markers in its white squares."""

    CHARUCO = "charuco"
    CHESSBOARD = "chessboard"


@dataclass(frozen=True, slots=True)
class Board:
    """A board of (columns + 1) x (rows + 1) squares.

    columns, rows: inner corners, as OpenCV counts them.  square_m, marker_m: sides [m].
    dictionary: the markers', by OpenCV's name without DICT_.
    """

    kind: BoardKind
    columns: int
    rows: int
    square_m: float
    marker_m: float
    dictionary: str = "4X4_50"

    @property
    def corner_count(self) -> int:
        """How many inner corners it has."""
        return self.columns * self.rows

    @property
    def corners_m(self) -> Array:
        """Inner corners (n, 3), row by row, x to the right, y down, from the first one [m]."""
        grid = np.mgrid[0 : self.columns, 0 : self.rows].T.reshape(-1, 2)
        return np.column_stack((grid * self.square_m, np.zeros(len(grid))))

    @property
    def outline_m(self) -> Array:
        """The four outermost corners (4, 2), clockwise [m]."""
        right, low = (self.columns - 1) * self.square_m, (self.rows - 1) * self.square_m
        return np.array([[0.0, 0.0], [right, 0.0], [right, low], [0.0, low]])

    @property
    def tells_its_top(self) -> bool:
        """Say whether it looks otherwise when turned by 180 deg."""
        return self.kind is BoardKind.CHARUCO or (self.columns + self.rows) % 2 == 1

    def __str__(self) -> str:
        return f"{self.kind} with {self.columns} x {self.rows} inner corners, squares of {1e3 * self.square_m:g} mm"


def make_board(
    kind: BoardKind, corners: str, square_mm: float, marker_mm: float | None = None, dictionary: str = "4X4_50"
) -> Board:
    """Check what the command line says of a board.

    Args:
        corners: inner corners, such as "9x6".
        marker_mm: side of the markers; None for 0.75 squares.
    Raises:
        OperatorError: no such size, a length that is not positive, an unknown or too small dictionary.
    """
    columns, rows = parse_pair(corners, "--corners", "inner corners")
    if not (min(columns, rows) >= FEWEST_CORNERS and max(columns, rows) <= MOST_CORNERS):
        raise OperatorError(f"--corners {corners}: must be {FEWEST_CORNERS} to {MOST_CORNERS} each way; 9x6 is usual")
    if not (np.isfinite(square_mm) and square_mm > 0):
        raise OperatorError(f"--square_mm {square_mm:g} mm: must be positive; measure a square of the print")
    marker_mm = MARKER_SHARE * square_mm if marker_mm is None else marker_mm
    if not 0 < marker_mm < square_mm:
        raise OperatorError(f"--marker_mm {marker_mm:g} mm: must be between 0 and the square's {square_mm:g} mm")
    board = Board(kind, columns, rows, square_mm / 1e3, marker_mm / 1e3, dictionary.upper().removeprefix("DICT_"))
    if kind is BoardKind.CHARUCO:
        _check_dictionary(board)
    return board


def parse_pair(text: str, option: str, what: str) -> tuple[int, int]:
    """Read "9x6".

    Raises:
        OperatorError: not two positive whole numbers with an x between.
    """
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(part.strip().isdecimal() and int(part) > 0 for part in parts):
        raise OperatorError(f"{option} {text!r}: must be two numbers of {what}, such as 9x6")
    return int(parts[0]), int(parts[1])


def charuco_of(board: Board) -> cv2.aruco.CharucoBoard:
    """Return OpenCV's board of it."""
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{board.dictionary}"))
    size = (board.columns + 1, board.rows + 1)
    return cv2.aruco.CharucoBoard(size, board.square_m, board.marker_m, dictionary)


def _check_dictionary(board: Board) -> None:
    known = sorted(name.removeprefix("DICT_") for name in dir(cv2.aruco) if name.startswith("DICT_"))
    if board.dictionary not in known:
        raise OperatorError(f"--dictionary {board.dictionary}: unknown; known: {', '.join(known)}")
    held = len(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{board.dictionary}")).bytesList)
    needed = (board.columns + 1) * (board.rows + 1) // 2
    if held < needed:
        raise OperatorError(
            f"--dictionary {board.dictionary}: holds {held} markers, the board needs {needed}; "
            "take 4X4_250 or fewer squares"
        )
