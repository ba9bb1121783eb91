"""One `posebridge sysid`, put together."""

from __future__ import annotations

from pathlib import Path

from rich.table import Table

from tools.screen import screen
from tools.sysid.certainty import COVERAGE
from tools.sysid.identify import identify
from tools.sysid.log_data import LogData
from tools.sysid.parameters import PARAMETERS
from tools.sysid.report import Report
from tools.sysid.validate import fit_percent


def identify_log(path: Path, read: LogData) -> Report:
    """Fit the hover model to a log that was read.

    Raises:
        OperatorError: too little excitation in it.
    """
    full_us = max(abs(us) for s in read.vehicle.servos for us in (s.right_us, s.nose_up_us, s.nose_right_us, s.up_us))
    return Report(path.name, read, identify(read.data, read.clock.sigma_s, 1.0 / full_us))


def to_table(report: Report) -> None:
    """Show the parameters, and how good the model is, on stdout; warnings on stderr."""
    found = report.found
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("parameter", "value", f"+- {COVERAGE:g} sigma", "unit"):
        table.add_column(column, justify="left" if column in ("parameter", "unit") else "right")
    for parameter, value, error in zip(PARAMETERS, found.theta, found.certainty.total, strict=True):
        table.add_row(parameter.name, f"{value:.4g}", f"{COVERAGE * error:.2g}", parameter.unit)
    console = screen()
    console.print(table)
    held_out = ", ".join(
        f"{name} {percent:.0f} %"
        for name, percent in zip(
            ("forward", "left", "up", "roll", "pitch", "yaw"), fit_percent(found.held_out), strict=True
        )
    )
    coherence = ", ".join(f"{each.axis} {each.heard:.2f}" for each in found.bodes)
    console.print(f"fit on the last third, not seen before: {held_out}", soft_wrap=True)
    console.print(f"coherence: {coherence}; residuals white: {found.whiteness.share:.0%}", soft_wrap=True)
    for warning in report.warnings():
        screen(stderr=True).print(f"posebridge: warning: {warning}", style="yellow", soft_wrap=True)
