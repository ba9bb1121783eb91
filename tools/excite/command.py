"""The command `posebridge excite`, as the command line registers it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tracker.errors import OperatorError

SHORTEST_S, LONGEST_S = 4.0, 60.0


def register(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command()(excite)


def excite(
    config: Annotated[str, typer.Option(help="A shipped config by name, or a path to a .toml.")] = "lab",
    out: Annotated[
        Path, typer.Option(help="The plan; a picture and the sticks as CSV go beside it.", metavar="FILE.toml")
    ] = Path("excite.toml"),
    sweep_s: Annotated[
        float, typer.Option("--sweep_s", "--sweep-s", help="Length of the cyclic sweeps [s].", metavar="S")
    ] = 10.0,
) -> None:
    """Plan stick inputs that a model can be found from, inside the room's volume and the vehicle's limits."""
    if not SHORTEST_S <= sweep_s <= LONGEST_S:
        raise OperatorError(f"--sweep_s: {sweep_s:g} s must be {SHORTEST_S:g} to {LONGEST_S:g} s; give a length within")
    from bridge.settings import load_settings
    from tools.excite.picture import draw_plan
    from tools.excite.plan import make_plan
    from tools.excite.plan_file import write_plan

    plan = make_plan(load_settings(config), sweep_s)
    write_plan(plan, out)
    picture = out.with_suffix(".png")
    x, y, z = (round(2e3 * half) for half in plan.half_m)
    room = f"seen room {x} x {y} x {z} mm"
    draw_plan(plan, f"Excitation plan, {plan.sequence.duration_s:.1f} s, {room}", picture)
    for each in plan.planned:
        typer.echo(str(each))
    typer.echo(f"{plan.sequence.duration_s:.1f} s, {room}. Plan: {out}, sticks: {out.with_suffix('.csv')}, {picture}")
