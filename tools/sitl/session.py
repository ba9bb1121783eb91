"""A flight in the loop: an autopilot's software, simulated cameras, the whole tracker and bridge.

    physics -> rendered frames -> tracker -> bridge -> MAVLink over UDP -> autopilot -> servos -> physics

Time is the simulation's: it stands while frames are rendered and tracked, so a slow computer flies the same flight.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

from rich.console import Console

from bridge.clock import StreamClock
from bridge.monitor import Monitor
from bridge.outlet import open_outlet
from bridge.run import Outlets, Steps, close, run
from bridge.settings import Settings, load_settings, rig_of
from bridge.settings.terms import terms_of
from bridge.status import StatusLine
from tools.request import Clocks
from tools.screen import screen
from tools.session import recorder_of, telemetry_of, tracker_of
from tools.simulate.helicopter import Helicopter
from tools.simulate.mission import Mission
from tools.sitl.aboard import PARAMETERS, Aboard, Conditions, home_of, running, simulated, started
from tools.sitl.aboard import close as close_aboard
from tools.sitl.faults import Faults
from tools.sitl.flight import Flight
from tools.sitl.held import hold
from tools.sitl.relay import Relay
from tools.sitl.report import SitlReport, flags_of, judge
from tools.sitl.setup import parameters
from tools.sitl.world import FLOOR_Z_M, World
from tools.steady import steady
from tracker.errors import OperatorError
from tracker.sources.paths import Pose
from tracker.sources.sim import START_NS, SimSource, SimTiming
from tracker.types import Estimate, Event, Step

LOG, REPORT = "sitl.mcap", "report.json"
FRAMES = ("heli",)
OWN, ARDUPILOT = "the project's simulated autopilot", "ArduPilot"
_RATE_HZ, _LONGEST_S = 15.0, 600.0
_CAMERA_DELAY_MS = 30


@dataclass(frozen=True, slots=True)
class SitlRequest:
    """One flight.

    binary: ArduPilot's program, None for the project's simulated autopilot.  out: folder for its files.
    connect: tcp:HOST:PORT of SERIAL0 of one that runs already, None for none.
    faults: whether to rehearse them.  mistakes: whether only to try those of `tools.sitl.mistakes`.
    mission_s: time for take-off, hover, square, turn and landing together.

    Raises:
        OperatorError: a frame that there is none of.
    """

    binary: Path | None
    frame: str
    config: str
    out: Path
    faults: bool
    mission_s: float = 45.0
    connect: str | None = None
    mistakes: bool = False

    def __post_init__(self) -> None:
        if self.binary is not None and self.connect is not None:
            raise OperatorError("--binary and --connect: start one or take one that runs; give one of them")
        if self.mistakes and (self.faults or self.connect is not None):
            raise OperatorError("--mistakes: starts a flight for each; give neither --faults nor --connect with it")
        if self.frame not in FRAMES:
            raise OperatorError(
                f"--frame {self.frame}: not known; known are {', '.join(FRAMES)}: that is all we have physics for"
            )


class _Witness:
    """Stand between loop and tracker: spoil what is to be spoiled, keep what the report needs."""

    def __init__(self, tracker: Steps, world: World, faults: Faults) -> None:
        self._tracker = tracker
        self._world = world
        self._faults = faults
        self.estimates: list[tuple[Estimate, Pose]] = []

    def step(self, event: Event) -> Step:
        """Take one event to the tracker."""
        return self._keep(self._tracker.step(event))

    def finish(self) -> Step:
        """Let the tracker finish."""
        return self._keep(self._tracker.finish())

    def _keep(self, step: Step) -> Step:
        self.estimates += [(estimate, self._world.pose_at(estimate.t_ns)) for estimate in step.estimates]
        return self._faults.spoiled(step)


def fly(request: SitlRequest, clocks: Clocks, console: Console | None = None) -> SitlReport:
    """Fly the plan and leave log and report in the request's folder.

    Raises:
        OperatorError: a program that does not start, or an autopilot that does not do what the plan wants.
    """
    console = console or screen(stderr=True)
    settings = load_settings(request.config)
    _make_folder(request.out)
    with ExitStack() as stack:
        aboard, flight, world = _set_up(request, settings, stack)
        faults = Faults(aboard.relay)
        world.told_aside_inW = lambda: faults.shift_inW
        rehearsal = faults.rehearse(world, flight) if request.faults else iter(())
        world.start(chain(_looked_at(request, world, console), flight.plan(world, rehearsal)))
        watched = replace(clocks, wall=faults.wall_ns(clocks.wall))
        witness, outlets = _run(request, settings, world, faults, aboard.relay, watched, console, stack)
    report = SitlReport(
        ARDUPILOT if request.binary or request.connect else OWN,
        judge(world.history, witness.estimates, flight.mission, world.done),
        outlets.summary(str(request.out / LOG)),
        {what: (at_ns - START_NS) / 1e9 for what, at_ns in flight.marks_ns.items()},
        flags_of(world.history),
        tuple(((at_ns - START_NS) / 1e9, text) for at_ns, text in world.ground.texts),
        tuple(faults.outcomes),
    )
    (request.out / REPORT).write_text(report.to_json(), encoding="utf-8")
    return report


def _looked_at(request: SitlRequest, world: World, console: Console) -> Iterator[None]:
    """See that a program that somebody else started holds the parameters of the flight."""
    if request.connect is None:
        return
    console.print(f"{request.connect}: taken; waiting for it to ask for physics")
    yield
    console.print(f"{request.connect}: it asks; waiting for its other port, reading its parameters")
    yield from hold(world, parameters(_CAMERA_DELAY_MS), request.out / PARAMETERS)


def _set_up(request: SitlRequest, settings: Settings, stack: ExitStack) -> tuple[Aboard, Flight, World]:
    """Start the autopilot and wire it up."""
    room_yaw_deg = settings.room.room_yaw_deg
    mission = Mission(request.mission_s, FLOOR_Z_M + Helicopter.skid_m)
    flight = Flight(mission, math.radians(room_yaw_deg))
    given = Conditions(room_yaw_deg, home_of(settings), _CAMERA_DELAY_MS, START_NS)
    if request.connect is not None:
        aboard = running(request.connect, request.out, given, flight.radio)
    elif request.binary is not None:
        aboard = started(request.binary, request.out, given, flight.radio, stack)
    else:
        aboard = simulated(given)
    stack.callback(close_aboard, aboard)
    place = (float(mission.ground_inW[0]), float(mission.ground_inW[1]))
    world = World(aboard.pilot, aboard.ground, aboard.relay, aboard.helicopter, START_NS, place, room_yaw_deg)
    return aboard, flight, world


def _run(
    request: SitlRequest,
    settings: Settings,
    world: World,
    faults: Faults,
    relay: Relay,
    clocks: Clocks,
    console: Console,
    stack: ExitStack,
) -> tuple[_Witness, Outlets]:
    """Run the loop until the plan is done; the one link is the relay's, in place of those the config names."""
    settings = settings.with_links((f"udpout:127.0.0.1:{relay.bridge_port}",))
    rig = rig_of(settings, None).rig
    timing = SimTiming(_RATE_HZ, _LONGEST_S, START_NS, delay_ns=1_000_000 * _CAMERA_DELAY_MS)
    source = stack.enter_context(SimSource(rig, world, clocks.stopwatch, timing, troubles=faults.troubles))
    witness = _Witness(tracker_of(settings, rig, clocks), world, faults)
    outlet = open_outlet(
        terms_of(settings, logged=True),
        component_id=settings.mavlink.component_id,
        room_yaw_deg=settings.room.room_yaw_deg,
        stopwatch=clocks.stopwatch,
    )
    about = {"source": "sitl", "autopilot": str(request.binary or request.connect or OWN)}
    recorder = recorder_of(request.out / LOG, settings, rig, about, clocks, overwrite=True, block_when_full=True)
    monitor = Monitor(tuple(camera.name for camera in rig.cameras))
    status = stack.enter_context(StatusLine(console, clocks.stopwatch))
    telemetry = telemetry_of("sitl", settings, rig, monitor, clocks)
    outlets, clock = Outlets(outlet, monitor, recorder, status, telemetry), StreamClock()
    try:
        with steady():
            run(faults.events(_until_done(source, world)), witness, clock, outlets)
    finally:
        close(clock, outlets)
    return witness, outlets


def _until_done(source: Iterable[Event], world: World) -> Iterator[Event]:
    for event in source:
        yield event
        if world.done:
            return


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OperatorError(f"--out {out}: cannot be made ({error.strerror}); name another folder") from error
