"""A board on paper: a PDF of lines and areas, with a ruler to check the print."""

from __future__ import annotations

from collections.abc import Iterator
from enum import StrEnum
from pathlib import Path

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from tools.calibrate.board import Board, BoardKind, charuco_of
from tracker.errors import OperatorError

MM_PER_INCH = 25.4
SIDE_MM = 12.0  # left free at left and right: white squares need paper round them, printers a margin
HEAD_MM, FOOT_MM = 14.0, 20.0
INK = "#000000"
Box = tuple[float, float, float, float]


class Paper(StrEnum):
    """A sheet, lying."""

    A4 = "A4"
    A3 = "A3"


SIZES_MM = {Paper.A4: (297.0, 210.0), Paper.A3: (420.0, 297.0)}


def largest_square_mm(paper: Paper, columns: int, rows: int) -> float:
    """Return the largest whole square [mm] of a board of so many inner corners that fits the sheet, at least 1."""
    width, height = SIZES_MM[paper]
    room = min((width - 2 * SIDE_MM) / (columns + 1), (height - HEAD_MM - FOOT_MM) / (rows + 1))
    return max(1.0, float(np.floor(room)))


def draw_sheet(board: Board, paper: Paper) -> Figure:
    """Draw a board at its own size, x to the right and y down in mm from the sheet's upper left corner.

    Raises:
        OperatorError: the board is larger than the sheet.
    """
    width, height = SIZES_MM[paper]
    square = 1e3 * board.square_m
    size = square * (board.columns + 1), square * (board.rows + 1)
    if size[0] > width - 2 * SIDE_MM or size[1] > height - HEAD_MM - FOOT_MM:
        fits = largest_square_mm(paper, board.columns, board.rows)
        raise OperatorError(
            f"--square_mm {square:g} mm: the board would be {size[0]:g} x {size[1]:g} mm, too large for {paper} with "
            f"its ruler; at most {fits:g} mm fit, or give --paper A3"
        )
    figure = Figure(figsize=(width / MM_PER_INCH, height / MM_PER_INCH), facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(0.0, width)
    axes.set_ylim(height, 0.0)
    axes.axis("off")
    left, top = (width - size[0]) / 2, HEAD_MM + (height - HEAD_MM - FOOT_MM - size[1]) / 2
    _fill(axes, [(left + x, top + y, w, h) for x, y, w, h in _areas_mm(board)])
    _text(axes, left, 8.0, f"posebridge  {board}" + _markers(board), 9)
    _ruler(axes, left, height - FOOT_MM + 6.0, size[0])
    return figure


def write_sheet(figure: Figure, path: Path) -> None:
    """Write the sheet as a PDF.

    Raises:
        OperatorError: it cannot be written.
    """
    try:
        figure.savefig(path, format="pdf", metadata={"CreationDate": None})
    except OSError as error:
        raise OperatorError(f"--out {path}: cannot be written ({error.strerror}); name a writable path") from error


def _areas_mm(board: Board) -> Iterator[Box]:
    """Yield the black areas: left, top, width, height from the board's upper left corner [mm]."""
    square = 1e3 * board.square_m
    for row in range(board.rows + 1):
        for column in range(board.columns + 1):
            if (row + column) % 2 == 0:
                yield column * square, row * square, square, square
    if board.kind is BoardKind.CHARUCO:
        yield from _marker_areas_mm(board)


def _marker_areas_mm(board: Board) -> Iterator[Box]:
    charuco = charuco_of(board)
    dictionary = charuco.getDictionary()
    bits = dictionary.markerSize + 2  # with the border
    module = 1e3 * board.marker_m / bits
    for marker, corners in zip(np.ravel(charuco.getIds()), charuco.getObjPoints(), strict=True):
        left, top = (1e3 * float(x) for x in corners[0][:2])
        image = cv2.aruco.generateImageMarker(dictionary, int(marker), bits)
        for row, values in enumerate(image):
            for start, end in _runs(values == 0):
                yield left + start * module, top + row * module, (end - start) * module, module


def _runs(black: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Iterator[tuple[int, int]]:
    """Yield where black begins and where it ends."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], black, [False])).astype(np.int8)))
    for start, end in edges.reshape(-1, 2):
        yield int(start), int(end)


def _fill(axes: Axes, boxes: list[Box]) -> None:
    corners = [[(x, y), (x + w, y), (x + w, y + h), (x, y + h)] for x, y, w, h in boxes]
    # Unsmoothed: smoothed edges of touching areas show as hairlines.
    axes.add_collection(PolyCollection(corners, facecolors=INK, edgecolors="none", linewidths=0, antialiaseds=False))


def _ruler(axes: Axes, left: float, top: float, room: float) -> None:
    """Draw a ruler of whole tens of mm."""
    length = int(room // 10) * 10
    axes.plot([left, left + length], [top, top], color=INK, lw=0.5)
    for mm in range(length + 1):
        tall = 4.0 if mm % 10 == 0 else 3.0 if mm % 5 == 0 else 2.0
        axes.plot([left + mm, left + mm], [top, top + tall], color=INK, lw=0.35, solid_capstyle="butt")
        if mm % 20 == 0:
            axes.text(left + mm, top + 4.6, str(mm), fontsize=6, ha="center", va="top", color=INK)
    words = f'Print at 100 %, not "fit to page". This ruler must be {length} mm long: measure it, and a square.'
    _text(axes, left, top - 1.5, words, 7)


def _text(axes: Axes, left: float, base: float, words: str, size: float) -> None:
    axes.text(left, base, words, fontsize=size, ha="left", va="bottom", color=INK)


def _markers(board: Board) -> str:
    if board.kind is BoardKind.CHESSBOARD:
        return ""
    return f", markers {board.dictionary} of {1e3 * board.marker_m:g} mm"
