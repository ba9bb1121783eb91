"""`posebridge sitl`."""

from __future__ import annotations

from rich.console import Console

from bridge.summary import to_text
from tools.request import Clocks
from tools.screen import screen
from tools.sitl.report import SitlReport
from tools.sitl.session import LOG, REPORT, SitlRequest, fly

WIDTH = 140
"""Of the widest table, in columns: a narrow terminal wraps it, where to cut figures off would lose them."""


def run_sitl(request: SitlRequest, clocks: Clocks) -> SitlReport:
    """Fly, and print what came of it on stdout."""
    report = fly(request, clocks)
    console = screen()
    console.width = max(console.width, WIDTH)
    show(report, request, console)
    return report


def show(report: SitlReport, request: SitlRequest, console: Console) -> None:
    """Print the figures, what the autopilot said, and the rehearsal."""
    console.print(to_text(report.summary), soft_wrap=True)
    console.print(f"Flown by {report.autopilot}, on poses of the rendered cameras alone.", soft_wrap=True)
    console.print(report.verdict.to_table())
    marks = ", ".join(f"{what} {at_s:.1f} s" for what, at_s in report.marks_s.items())
    console.print(f"reached: {marks}\nEKF flags in flight: {', '.join(report.flags)}", soft_wrap=True)
    if report.outcomes:
        console.print(report.faults_table())
        for outcome in report.outcomes:
            for text in outcome.texts:
                console.print(f"{outcome.fault.name}: autopilot said: {text}", soft_wrap=True)
    console.print(f"Log and report: {request.out / LOG}, {request.out / REPORT}", soft_wrap=True)
