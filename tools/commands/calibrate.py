"""`posebridge calibrate`: boards, cameras, rooms, and files of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tools.commands.common import ConfigOption, JsonOption, SourceOption, clocks_of, flag, tell_of_compiling
from tools.commands.group import Commands

EXIT_CALIBRATION_NOT_GOOD = 1

calibrate = Commands(help="Calibrate cameras: print a board, find lenses, find the room, convert files.")

KindOption = Annotated[str, typer.Option("--board", help="charuco or chessboard.", metavar="KIND")]
CornersOption = Annotated[str, typer.Option(help="Inner corners of the board, as OpenCV counts them.", metavar="CxR")]
DictionaryOption = Annotated[str, typer.Option(help="The markers' dictionary, by OpenCV's name.", metavar="NAME")]
OverwriteOption = Annotated[bool, flag("--overwrite", "Replace files that exist.")]
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
    file: Annotated[Path, typer.Argument(help="TOML, Kalibr, ROS, EuRoC or OpenCV; or a folder of such.")],
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


@calibrate.command()
def intrinsics(
    context: typer.Context,
    config: ConfigOption = "lab",
    source: Annotated[
        str, typer.Option(help="images:LEFT*.png,RIGHT*.png (a glob or folder a camera), or as for run.", metavar="URI")
    ] = "camera:0,1",
    kind: KindOption = "charuco",
    corners: CornersOption = "9x6",
    square_mm: Annotated[
        float, typer.Option("--square_mm", "--square-mm", help="A square's side, measured on the print.")
    ] = 25.0,
    marker_mm: MarkerOption = None,
    dictionary: DictionaryOption = "4X4_50",
    coefficients: Annotated[int, typer.Option(help="Of lens distortion: 4, 5 or 8.")] = 5,
    distance_m: Annotated[
        float, typer.Option("--distance_m", "--distance-m", help="From a camera to where is flown.")
    ] = 3.2,
    out: Annotated[
        Path | None, typer.Option(help="Write the cameras here, as a config lists them.", metavar="FILE")
    ] = None,
    to: Annotated[str | None, typer.Option(help="Another format for it, as for convert.", metavar="FORMAT")] = None,
    picture: Annotated[Path | None, typer.Option(help="Draw coverage and errors here.", metavar="FILE.png")] = None,
    overwrite: OverwriteOption = False,
    json: JsonOption = False,
) -> None:
    """Find each camera's lens, and how well it is known, from views of a board.

    Exit code 0: good. 1: not good, with the reasons. 2: no board, too few views, or other bad input.
    """
    from tools.calibrate.board import make_board
    from tools.calibrate.command import kind_of
    from tools.calibrate.session import IntrinsicsRequest, run_intrinsics

    board = make_board(kind_of(kind), corners, square_mm, marker_mm, dictionary)
    request = IntrinsicsRequest(config, source, board, coefficients, distance_m, out, to, picture, overwrite, json)
    if not run_intrinsics(request, clocks_of(context)).good:
        raise typer.Exit(EXIT_CALIBRATION_NOT_GOOD)


@calibrate.command()
def room(
    context: typer.Context,
    config: ConfigOption = "lab",
    source: SourceOption = "camera:0,1",
    cameras: Annotated[
        list[Path] | None,
        typer.Option(
            help="Lenses, as from calibrate intrinsics; the config's if left out. May be given again.", metavar="FILE"
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Write the room file here: the config with these cameras.", metavar="ROOM.toml")
    ] = None,
    frame: Annotated[
        str,
        typer.Option(
            help="spots: level, heading and origin by three spots; board: by one on the floor; config: by its cameras."
        ),
    ] = "spots",
    kind: KindOption = "charuco",
    corners: CornersOption = "4x3",
    square_mm: Annotated[
        float, typer.Option("--square_mm", "--square-mm", help="A square's side of the board on the floor.")
    ] = 75.0,
    marker_mm: MarkerOption = None,
    dictionary: DictionaryOption = "4X4_50",
    apart_mm: Annotated[
        float | None, typer.Option("--apart_mm", "--apart-mm", help="From the first spot to the second, by tape.")
    ] = None,
    origin_mm: Annotated[
        str,
        typer.Option(
            "--origin_mm",
            "--origin-mm",
            help="Where in the room the marker's middle is on the first spot, or the board's first inner corner.",
            metavar="X,Y,Z",
        ),
    ] = "0,0,0",
    refine_intrinsics: Annotated[
        bool, flag("--refine-intrinsics", "Adjust focal lengths and centres as well.")
    ] = False,
    by: Annotated[str, typer.Option(help="Who measured, for the room file.", metavar="NAME")] = "",
    seconds: Annotated[float, typer.Option(help="Of footage to read at most.")] = 180.0,
    overwrite: OverwriteOption = False,
    json: JsonOption = False,
) -> None:
    """Find where the cameras hang and how their clocks differ, from the marker waved through the room.

    Then the vehicle stands for 3 s on each of three level spots: at the origin, along x from there, and aside.
    Or a board lies on the floor, its first inner corner the origin, its x axis the room's (docs/room.md).
    Exit code 0: good or usable. 1: not good, with the reasons. 2: something to mend first.
    """
    from tools.calibrate.board import make_board
    from tools.calibrate.command import kind_of
    from tools.calibrate.grade import Grade
    from tools.calibrate.room.session import RoomRequest, run_room

    floor = make_board(kind_of(kind), corners, square_mm, marker_mm, dictionary)
    request = RoomRequest(
        config, source, tuple(cameras or ()), frame, floor, origin_mm, apart_mm, refine_intrinsics, by, seconds, out,
        overwrite, json,
    )  # fmt: skip
    tell_of_compiling()
    if run_room(request, clocks_of(context)).grade is Grade.NOT_GOOD:
        raise typer.Exit(EXIT_CALIBRATION_NOT_GOOD)


@calibrate.command()
def refine(
    context: typer.Context,
    log: Annotated[Path, typer.Argument(help="The log of a flight in which a camera was bumped.")],
    moved: Annotated[
        list[str] | None,
        typer.Option(
            help="The camera that moved; else those that the flight named. May be given again.", metavar="CAM"
        ),
    ] = None,
    config: Annotated[
        str | None,
        typer.Option(help="The config flown with, whose comments are kept; else the log's.", metavar="CONFIG"),
    ] = None,
    by: Annotated[str, typer.Option(help="Who mended, for the room file.", metavar="NAME")] = "",
    out: Annotated[
        Path | None, typer.Option(help="Write the room file here: the config with these cameras.", metavar="ROOM.toml")
    ] = None,
    overwrite: OverwriteOption = False,
    json: JsonOption = False,
) -> None:
    """Mend bumped cameras from a flight's log; those that did not move hold the room (docs/health.md).

    Exit code 0: good or usable. 1: not good. 2: no camera moved, all did, or too little was seen since.
    """
    from tools.calibrate.grade import Grade
    from tools.calibrate.refine.session import RefineRequest, run_refine

    request = RefineRequest(log, tuple(moved or ()), config, by, out, overwrite, json)
    if run_refine(request, clocks_of(context)).grade is Grade.NOT_GOOD:
        raise typer.Exit(EXIT_CALIBRATION_NOT_GOOD)
