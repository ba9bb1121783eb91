"""The command that says where the cameras go."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tools.commands.common import ConfigOption, JsonOption, flag, tell_of_compiling

EXIT_PLACE_NOT_GOOD = 1


def place(
    config: ConfigOption = "lab",
    cameras: Annotated[
        int | None, typer.Option(help="Place so many, 2 to 8. Left out: judge the config's own.", metavar="N")
    ] = None,
    room: Annotated[str | None, typer.Option(help="Walls, floor, ceiling, in m.", metavar="X0,X1,Y0,Y1,Z0,Z1")] = None,
    volume: Annotated[str | None, typer.Option(help="Where it flies, in m.", metavar="X0,X1,Y0,Y1,Z0,Z1")] = None,
    walls: Annotated[str | None, typer.Option(help="Where cameras may hang: x-,x+,y-,y+,ceiling.")] = None,
    lenses: Annotated[str | None, typer.Option(help="Horizontal fields of view to choose from, in deg.")] = None,
    move: Annotated[
        list[str] | None,
        typer.Option(help="What if this camera moved, in m? May be repeated.", metavar="CAM:X,Y,Z"),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write pictures, cameras and a config here.", metavar="DIR")] = None,
    seed: Annotated[int, typer.Option(help="Same seed, same places.", metavar="N")] = 1,
    fly: Annotated[bool, flag("--fly", "Check the forecast by a simulated flight.")] = False,
    paper: Annotated[bool, flag("--paper", "The paper's figures and tables, redrawn.")] = False,
    json: JsonOption = False,
) -> None:
    """Say where to put the cameras, or how good their places are, by the errors to be expected over the volume.

    What it may choose from stands in the config's table `place`. Exit code 1 when the layout does not cover the volume.
    """
    tell_of_compiling()
    from tools.place.command import PlaceRequest, run_paper, run_place
    from tools.place.limits import Wishes

    if paper:
        run_paper(out, json)
        return
    wishes = Wishes(room, volume, walls, lenses)
    if not run_place(PlaceRequest(config, cameras, wishes, tuple(move or ()), out, seed, fly, json)):
        raise typer.Exit(EXIT_PLACE_NOT_GOOD)
