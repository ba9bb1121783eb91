"""What several commands share: options, the real clocks, the notice of compiling."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import typer

from tools.request import Clocks, CpuClocks

EXIT_NO_POSE = 1


def flag(name: str, help: str) -> Any:
    """Describe an option that takes no value: its help names no type."""
    return typer.Option(name, help=help, metavar="")


ConfigOption = Annotated[str, typer.Option(help="A shipped config by name, or a path to a .toml.")]
JsonOption = Annotated[bool, flag("--json", "Print the figures as JSON.")]
SourceOption = Annotated[
    str, typer.Option(help="recording:DIR, video:A.mp4,B.mp4, camera:0,1, sim:NAME or log:FILE.mcap.", metavar="URI")
]


@dataclass(frozen=True, slots=True)
class RealClocks:
    """What the command line hands to every command, as its context's `obj`."""

    clocks: Clocks
    cpu: CpuClocks


def clocks_of(context: typer.Context) -> Clocks:
    """Return the clocks that the command line took."""
    real: RealClocks = context.obj
    return real.clocks


def cpu_clocks_of(context: typer.Context) -> CpuClocks:
    """Return the clocks of CPU time that the command line took."""
    real: RealClocks = context.obj
    return real.cpu


def tell_of_compiling() -> None:
    """Tell on stderr, once, if anything is compiled from here on."""
    from tools.first_start import tell_of_compiling

    tell_of_compiling(lambda line: typer.echo(f"posebridge: {line}", err=True))
