"""`posebridge calibrate`: boards, cameras, and files of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

calibrate = typer.Typer(help="Calibrate cameras: print a board, find intrinsics, convert files (docs/calibrate.md).")

KindOption = Annotated[str, typer.Option("--board", help="charuco or chessboard.", metavar="KIND")]
CornersOption = Annotated[str, typer.Option(help="Inner corners of the board, as OpenCV counts them.", metavar="CxR")]
DictionaryOption = Annotated[str, typer.Option(help="The markers' dictionary, by OpenCV's name.", metavar="NAME")]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Replace files that exist.")]
MarkerOption = Annotated[
    float | None, typer.Option("--marker_mm", "--marker-mm", help="A marker's side; 0.75 squares if left out.")
]


@calibrate.command()
def board(
    out: Annotated[Path, typer.Option(help="The sheet to write.", metavar="FILE.pdf")],
    kind: KindOption = "charuco",
    corners: CornersOption = "9x6",
    paper: Annotated[str, typer.Option(help="A4 or A3.")] = "A4",
    square_mm: Annotated[
        float | None, typer.Option("--square_mm", "--square-mm", help="A square's side; the largest if left out.")
    ] = None,
    marker_mm: MarkerOption = None,
    dictionary: DictionaryOption = "4X4_50",
    overwrite: OverwriteOption = False,
) -> None:
    """Print a board as a PDF at its own size, with a ruler to check the print."""
    from tools.calibrate.command import BoardRequest, print_board

    request = BoardRequest(out, kind, corners, paper, square_mm, marker_mm, dictionary, overwrite)
    typer.echo(print_board(request))


@calibrate.command()
def convert(
    file: Annotated[Path, typer.Argument(help="TOML, Kalibr, ROS, EuRoC or OpenCV; or a folder with mav0.")],
    out: Annotated[Path, typer.Argument(help="The file to write; a folder for several cameras as ROS or EuRoC.")],
    to: Annotated[
        str | None, typer.Option(help="toml, kalibr, ros, euroc or opencv; .toml needs no asking.", metavar="FORMAT")
    ] = None,
    size: Annotated[
        str | None, typer.Option(help="Image size, for OpenCV files that do not tell.", metavar="WxH")
    ] = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Turn one calibration file into another; what the new one cannot hold is said on stderr."""
    from tools.calibrate.command import ConvertRequest, convert_file

    for line in convert_file(ConvertRequest(file, out, to, size, overwrite)):
        typer.echo(f"posebridge: {line}", err=True)
