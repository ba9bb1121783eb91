"""The commands before take-off: colours, key, check."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tools.commands.common import ConfigOption, JsonOption, SourceOption, clocks_of, flag, tell_of_compiling

EXIT_COLOURS_NOT_GOOD = 1
EXIT_CHECK_NOT_GOOD = 1


def colours(
    context: typer.Context,
    config: ConfigOption = "lab",
    source: SourceOption = "camera:0,1",
    frames: Annotated[int, typer.Option(help="Read at most so many frames of each camera.", metavar="N")] = 300,
    picture: Annotated[
        Path | None, typer.Option(help="Show here what would be detected, and what clashes.", metavar="FILE.png")
    ] = None,
    write: Annotated[
        Path | None, typer.Option(help="Write a copy of the config with the learned colours.", metavar="FILE.toml")
    ] = None,
    overwrite: Annotated[bool, flag("--overwrite", "Replace a config that exists.")] = False,
    json: JsonOption = False,
) -> None:
    """Learn the balls' colours from footage and warn of things in the room that look like them.

    Carry the vehicle slowly through the room meanwhile. Exit code 1 when the colours are not good to fly with.
    """
    tell_of_compiling()
    from tools.colours.command import ColoursRequest, run_colours

    request = ColoursRequest(config, source, frames, picture, write, overwrite, json)
    if not run_colours(request, clocks_of(context)):
        raise typer.Exit(EXIT_COLOURS_NOT_GOOD)


def key(file: Annotated[Path, typer.Argument(help="The file to make; none may be there yet.")]) -> None:
    """Make a secret key for MAVLink 2 signing: the `signing_key` of the config (docs/autopilots.md)."""
    from bridge.signing import make_key

    make_key(file)
    typer.echo(f"{file}: 64 hexadecimal digits, mode 600; name it as [mavlink] signing_key in the config", err=True)


def check(
    context: typer.Context,
    config: ConfigOption = "lab",
    source: Annotated[
        str, typer.Option(help="As for run; none: look at the autopilot alone, without poses.", metavar="URI")
    ] = "camera:0,1",
    link: Annotated[
        str | None, typer.Option(help="The autopilot's link, as for run. Replaces the config's.", metavar="URI")
    ] = None,
    duration_s: Annotated[
        float, typer.Option("--duration_s", "--duration-s", help="How long poses are watched, in s.", metavar="S")
    ] = 10.0,
    frame: Annotated[bool, flag("--frame", "Lead through the frame check: four moves by hand.")] = False,
    wiggle: Annotated[bool, flag("--wiggle", "Find the delay while you wiggle the vehicle.")] = False,
    apply: Annotated[bool, flag("--apply", "Write the wrong parameters, after asking.")] = False,
    yes: Annotated[bool, flag("--yes", "Do not ask before writing.")] = False,
    json: JsonOption = False,
) -> None:
    """Prove before take-off that the autopilot uses the poses: one page, a verdict a line, with its fix.

    Exit code 0 when nothing speaks against flying; 1 when something failed or could not be seen.
    """
    from tools.check.request import CheckRequest

    request = CheckRequest(config, source, link, duration_s, frame, wiggle, apply, yes, json)

    tell_of_compiling()
    from tools.check.session import run_check

    if not run_check(request, clocks_of(context)):
        raise typer.Exit(EXIT_CHECK_NOT_GOOD)
