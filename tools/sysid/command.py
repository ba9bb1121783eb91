"""The commands `posebridge sysid` and `posebridge excite`, as the command line registers them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import orjson
import typer

from tracker.errors import OperatorError

MODELS = ("hover",)


def register(app: typer.Typer) -> None:
    """Add the commands to the command line."""
    app.command()(sysid)


def sysid(
    log: Annotated[Path, typer.Argument(help="A log of an excited flight (docs/sysid.md).")],
    model: Annotated[str, typer.Option(help="What to fit: hover.")] = "hover",
    config: Annotated[
        str | None, typer.Option(help="Take the vehicle's sheet from this config, not from the log.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Write the report here; else beside the log.", metavar="FILE.html")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
) -> None:
    """Find the vehicle's model from a log: parameters with their errors, and a report with pictures."""
    if model not in MODELS:
        raise OperatorError(f"--model {model}: unknown; known are {', '.join(MODELS)}")
    from bridge.settings import load_settings
    from tools.sysid.log_data import read_log
    from tools.sysid.session import identify_log, to_table

    sheet = None
    if config is not None:
        sheet = load_settings(config).vehicle
        if sheet is None:
            raise OperatorError(f"--config {config}: holds no [vehicle] sheet; add one (docs/sysid.md)")
    report = identify_log(log, read_log(log, sheet))
    page = out or log.with_suffix(".sysid.html")
    try:
        page.write_text(report.to_html(), encoding="utf-8")
    except OSError as error:
        raise OperatorError(f"--out {page}: cannot be written ({error.strerror}); name another file") from error
    if json:
        typer.echo(orjson.dumps(report.plain(), option=orjson.OPT_INDENT_2).decode())
    else:
        to_table(report)
    typer.echo(f"report: {page}", err=True)
