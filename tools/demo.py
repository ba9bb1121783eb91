"""The whole of posebridge with nothing attached: a simulated helicopter flies on the poses the bridge sends it.

    world (helicopter, wind, autopilot) -> rendered frames -> tracker -> MAVLink over UDP -> the world's autopilot

Nothing but those datagrams leads back to the helicopter.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from bridge.clock import Clock, HostClock, StreamClock
from bridge.monitor import Monitor
from bridge.pace import Paced
from bridge.run import Outlets, Steps, close, run
from bridge.settings import Settings, load_settings, rig_of
from bridge.status import StatusLine
from bridge.summary import Summary, to_text
from bridge.wire import Sent
from tools.demo_plot import draw_flight
from tools.kept import keep_flight
from tools.request import Clocks, DemoRequest, Pace
from tools.screen import screen
from tools.seen_picture import draw_seen
from tools.session import links_of, recorder_of, telemetry_of, tracker_of
from tools.simulate.autopilot.vessel import Mode
from tools.simulate.flight import Flight, flight_of
from tools.simulate.helicopter import Helicopter
from tools.simulate.mission import Mission
from tools.simulate.verdict import Verdict, judge
from tools.simulate.world import Surroundings, World
from tools.steady import steady
from tools.summary_file import write_summary
from tracker.errors import OperatorError
from tracker.rig import Rig
from tracker.sources.paths import Pose, Vehicle
from tracker.sources.sim import START_NS, SimSource, SimTiming
from tracker.types import Estimate, Event, Frame, Step

SOURCE = "demo"
LOG, SUMMARY, VERDICT, PLOT, SEEN = "flight.mcap", "summary.json", "verdict.json", "flight.png", "seen.png"
DEMO_CONFIG = "lab"
_RATE_HZ = 15.0
_PATIENCE_MS = 3_600_000.0  # the world waits while this computer is busy, so a pose is never as old as it seems
_TALK_S = 10.0
"""At most so long may bridge and autopilot talk before the flight: of the origin, until the filter trusts the poses."""

_REST_NS = 1_000_000_000


@dataclass(frozen=True, slots=True, eq=False)
class DemoResult:
    """What a demo flight came to. out: the folder with log, summary, verdict and picture."""

    flight: Flight
    verdict: Verdict
    summary: Summary
    out: Path


def run_demo(request: DemoRequest, clocks: Clocks, console: Console | None = None) -> DemoResult:
    """Fly the demo mission and leave log, summary, verdict and picture in the request's folder.

    With pace `fast` the same seed gives the same flight.

    Raises:
        OperatorError: a folder that cannot be made, or too short a time.
    """
    console = console or screen(stderr=True)
    surroundings, helicopter = Surroundings(), Helicopter()
    mission = Mission(request.duration_s, surroundings.floor_z_m + helicopter.skid_m)
    make_folder(request.out)
    settings = load_settings(DEMO_CONFIG)
    with ExitStack() as stack:
        world = World(mission, START_NS, surroundings, helicopter, request.seed)
        stack.callback(world.close)
        witness, summary = fly(request, clocks, settings, world, console)
        flight = flight_of(
            world.history,
            witness.estimates,
            witness.latency_ms,
            mission.corners_inW,
            world.autopilot.mode is Mode.LANDED,
        )
    result = DemoResult(flight, judge(flight), summary, request.out)
    _leave(result, request)
    if witness.seen is not None:
        step = witness.seen.step
        draw_seen(witness.seen.frames, step.sightings, step.estimates[0], witness.rig, request.out / SEEN)
    return result


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """One instant in which every ball was seen: its frames and what came of them."""

    frames: tuple[Frame, ...]
    step: Step


class _Witness:
    """Stand between tracker and outlet and keep what the verdict needs: estimates, truth at their time, latencies.

    picture_ns: the first instant from then on in which every ball is seen is kept whole, for a picture.
    """

    def __init__(self, tracker: Steps, vehicle: Vehicle, rig: Rig, picture_ns: int) -> None:
        self._tracker = tracker
        self._vehicle = vehicle
        self._wanted = len(rig.cameras) * len(rig.marker)
        self._picture_ns = picture_ns
        self._frames: dict[int, Frame] = {}
        self.rig = rig
        self.seen: _Seen | None = None
        self.estimates: list[tuple[Estimate, Pose]] = []
        self.latency_ms: list[float] = []

    def step(self, event: Event) -> Step:
        """Take one event to the tracker."""
        step = self._keep(self._tracker.step(event))
        if isinstance(event, Frame) and self.seen is None and event.t_ns >= self._picture_ns:
            self._frames[event.camera] = event
            if step.estimates and len(step.sightings) == self._wanted:
                self.seen = _Seen(tuple(self._frames[camera] for camera in sorted(self._frames)), step)
        return step

    def finish(self) -> Step:
        """Let the tracker finish."""
        return self._keep(self._tracker.finish())

    def heard(self, sent: tuple[Sent, ...]) -> tuple[Sent, ...]:
        """Note how late messages left."""
        self.latency_ms += [(each.sent_ns - each.available_ns) / 1e6 for each in sent if each.available_ns]
        return sent

    def _keep(self, step: Step) -> Step:
        self.estimates += [(estimate, self._vehicle.pose_at(estimate.t_ns)) for estimate in step.estimates]
        return step


class _WatchedMonitor(Monitor):
    """A monitor that lets the witness see what was sent."""

    def __init__(self, camera_names: tuple[str, ...], witness: _Witness) -> None:
        super().__init__(camera_names)
        self._witness = witness

    def take(self, event: Event | None, step: Step, sent: tuple[Sent, ...]) -> None:
        """Count one turn of the loop."""
        super().take(event, step, self._witness.heard(sent))


def fly(
    request: DemoRequest, clocks: Clocks, settings: Settings, world: World, console: Console
) -> tuple[_Witness, Summary]:
    """Run the loop once around."""
    settings = _as_flown(settings, request, world)
    rig = rig_of(settings, None).rig
    timing = SimTiming(_RATE_HZ, request.duration_s + _TALK_S, START_NS, delay_ns=world.surroundings.delay_ns)
    log = request.out / LOG
    keep_flight(log, SOURCE)
    with ExitStack() as stack:
        source = stack.enter_context(SimSource(rig, world, clocks.stopwatch, timing, seed=request.seed))
        halfway_ns = START_NS + round(request.duration_s / 2.0 * 1e9)
        witness = _Witness(tracker_of(settings, rig, clocks), world, rig, halfway_ns)
        outlet = links_of(settings, clocks, logged=True)
        stack.callback(outlet.close)
        about = {"source": SOURCE, "pace": request.pace.value, "seed": str(request.seed)}
        fast = request.pace is Pace.FAST
        recorder = recorder_of(log, settings, rig, about, clocks, overwrite=True, block_when_full=fast)
        monitor = _WatchedMonitor(tuple(camera.name for camera in rig.cameras), witness)
        status = stack.enter_context(StatusLine(console, clocks.stopwatch))
        telemetry = telemetry_of(SOURCE, settings, rig, monitor, clocks)
        outlets = Outlets(outlet, monitor, recorder, status, telemetry)
        stack.enter_context(steady())
        delay_ns = world.surroundings.delay_ns
        clock: Clock = StreamClock(delay_ns) if fast else HostClock(clocks.monotonic, START_NS)
        frames = _until_landed(source, world)
        events = frames if fast else Paced(frames, clock, clocks.sleep_s, clocks.stopwatch, delay_ns)
        try:
            run(events, witness, clock, outlets)
        finally:
            close(clock, outlets)
    if isinstance(events, Paced) and events.worst_lag_ns > 1e9 / _RATE_HZ:
        lag_ms = events.worst_lag_ns / 1e6
        warning = f"posebridge: warning: up to {lag_ms:.0f} ms behind real time; this computer is busy or slow"
        console.print(warning, style="yellow", soft_wrap=True)
    return witness, outlets.summary(str(log))


def _until_landed(source: SimSource, world: World) -> Iterator[Event]:
    """Yield the frames until the vehicle has stood for a second after its landing.

    What the bridge sends for a frame is heard at once: an autopilot that read it at its next round only would answer
    time sync late, and its clock would be wrong in the log by half a round.
    """
    landed_ns: int | None = None
    for event in source:
        yield event
        if isinstance(event, Frame):
            world.hear(event.t_ns + world.surroundings.delay_ns)
        now_ns = world.history[-1].t_ns
        if world.autopilot.mode is Mode.LANDED:
            landed_ns = now_ns if landed_ns is None else landed_ns
            if now_ns - landed_ns >= _REST_NS:
                return


def _as_flown(settings: Settings, request: DemoRequest, world: World) -> Settings:
    """Return the settings of this flight, as its log is to hold them: one link, to the simulated autopilot."""
    room = settings.room.model_copy(update={"room_yaw_deg": world.surroundings.room_yaw_deg})
    mavlink = settings.mavlink.model_copy(update={"max_age_ms": _PATIENCE_MS})
    linked = settings.with_links((f"udpout:127.0.0.1:{world.autopilot.port}",)).with_frames(request.frames, None)
    return linked.model_copy(update={"room": room, "mavlink": mavlink})


def make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OperatorError(f"--out {out}: cannot be made ({error.strerror}); name another folder") from error


def _leave(result: DemoResult, request: DemoRequest) -> None:
    """Write the files and show the figures."""
    write_summary(request.out / SUMMARY, result.summary)
    (request.out / VERDICT).write_text(result.verdict.to_json(), encoding="utf-8")
    held = "held its path" if result.verdict.passed else "DID NOT hold its path"
    title = f"posebridge demo: {request.duration_s:g} s, seed {request.seed}, the helicopter {held}"
    draw_flight(result.flight, title, request.out / PLOT)
    report = screen()
    report.print(to_text(result.summary), soft_wrap=True)
    report.print(result.verdict.to_table())
    report.print(f"{held[0].upper()}{held[1:]}. Log, summary, verdict and picture: {request.out}", soft_wrap=True)
