"""The demo's helicopter flies a plan: a log for system identification, made through rendered cameras."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, replace

import numpy as np
from rich.console import Console

from bridge.settings import load_settings
from bridge.summary import Summary, to_text
from tools.demo import DEMO_CONFIG, LOG, SUMMARY, fly, make_folder
from tools.excite.hover import ExcitedHover
from tools.excite.manoeuvre import Sequence
from tools.request import Clocks, DemoRequest
from tools.screen import screen
from tools.simulate.autopilot.vessel import Mode
from tools.simulate.helicopter import Helicopter
from tools.simulate.world import Surroundings, World
from tools.summary_file import write_summary
from tracker.sources.sim import START_NS
from tracker.types import Array


@dataclass(frozen=True, slots=True, eq=False)
class ExcitedFlight:
    """What came of it. landed: it came to its end.  reach_m: farthest from the room's origin along each axis (3,)."""

    landed: bool
    reach_m: Array
    summary: Summary


def fly_plan(request: DemoRequest, sequence: Sequence, clocks: Clocks, console: Console | None = None) -> ExcitedFlight:
    """Fly a sequence in place of the demo's own mission; the request's duration gives way to the sequence's.

    Raises:
        OperatorError: a folder that cannot be made.
    """
    surroundings, helicopter = Surroundings(), Helicopter()
    mission = ExcitedHover(sequence, surroundings.floor_z_m + helicopter.skid_m)
    make_folder(request.out)
    with ExitStack() as stack:
        world = World(mission, START_NS, surroundings, helicopter, request.seed, mission.excitation)
        stack.callback(world.close)
        request = replace(request, duration_s=mission.duration_s)
        _, summary = fly(request, clocks, load_settings(DEMO_CONFIG), world, console or screen(stderr=True))
        flown = np.array([moment.p_BinW for moment in world.history])
        landed = world.autopilot.mode is Mode.LANDED
    write_summary(request.out / SUMMARY, summary)
    report = screen()
    report.print(to_text(summary), soft_wrap=True)
    reach_m = np.abs(flown).max(axis=0)
    report.print(f"Flown {'to its end' if landed else 'in part'}; log: {request.out / LOG}", soft_wrap=True)
    return ExcitedFlight(landed, reach_m, summary)
