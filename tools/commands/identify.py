"""The commands that lead to a model of the vehicle: plan a flight that excites it, fit the model to its log."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import orjson
import typer

from tools.commands.common import ConfigOption, JsonOption
from tools.suffix import check_suffix
from tracker.errors import OperatorError

MODELS = ("hover",)
SHORTEST_S, LONGEST_S = 4.0, 60.0


def sysid(
    log: Annotated[Path, typer.Argument(help="A log of an excited flight (docs/sysid.md).")],
    model: Annotated[str, typer.Option(help="What to fit: hover.")] = "hover",
    config: Annotated[
        str | None, typer.Option(help="Take the vehicle's sheet from this config, not from the log.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Write the report here; else beside the log.", metavar="FILE.html")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Find the vehicle's model from a log: parameters with their errors, and a report with pictures."""
    if model not in MODELS:
        raise OperatorError(f"--model {model}: unknown; known are {', '.join(MODELS)}")
    from bridge.log.reader import LogReader
    from bridge.settings import load_settings
    from tools.kept import keep
    from tools.sysid.log_data import read_log
    from tools.sysid.session import identify_log, to_table

    LogReader(log)  # says what is wrong with it, before a file is named by it
    sheet = None
    if config is not None:
        sheet = load_settings(config).vehicle
        if sheet is None:
            raise OperatorError(f"--config {config}: holds no [vehicle] sheet; add one (docs/sysid.md)")
    page = out or log.with_suffix(".sysid.html")
    keep((log,), page, "--out")
    check_suffix(page, "--out", ".html")
    report = identify_log(log, read_log(log, sheet))
    try:
        page.write_text(report.to_html(), encoding="utf-8")
    except OSError as error:
        raise OperatorError(f"--out {page}: cannot be written ({error.strerror}); name another file") from error
    if json:
        typer.echo(orjson.dumps(report.plain(), option=orjson.OPT_INDENT_2).decode())
    else:
        to_table(report)
    typer.echo(f"report: {page}", err=True)


def excite(
    config: ConfigOption = "lab",
    out: Annotated[
        Path, typer.Option(help="The plan; a picture and the sticks as CSV go beside it.", metavar="FILE.toml")
    ] = Path("excite.toml"),
    sweep_s: Annotated[
        float, typer.Option("--sweep_s", "--sweep-s", help="Length of the cyclic sweeps, in s.", metavar="S")
    ] = 10.0,
) -> None:
    """Plan stick inputs that a model can be found from, inside the room's volume and the vehicle's limits."""
    if not SHORTEST_S <= sweep_s <= LONGEST_S:
        raise OperatorError(f"--sweep_s: {sweep_s:g} s must be {SHORTEST_S:g} to {LONGEST_S:g} s; give a length within")
    from bridge.settings import config_path, load_settings
    from tools.excite.picture import draw_plan
    from tools.excite.plan import make_plan
    from tools.excite.plan_file import write_plan
    from tools.kept import keep

    keep((config_path(config),), out, "--out")
    check_suffix(out, "--out", ".toml")
    plan = make_plan(load_settings(config), sweep_s)
    write_plan(plan, out)
    picture = out.with_suffix(".png")
    x, y, z = (round(2e3 * half) for half in plan.half_m)
    room = f"seen room {x} x {y} x {z} mm"
    draw_plan(plan, f"Excitation plan, {plan.sequence.duration_s:.1f} s, {room}", picture)
    for each in plan.planned:
        typer.echo(str(each))
    typer.echo(f"{plan.sequence.duration_s:.1f} s, {room}. Plan: {out}, sticks: {out.with_suffix('.csv')}, {picture}")
