"""One `posebridge run`, put together: settings in, a source flown to its end, figures out."""

from __future__ import annotations

import importlib.metadata
import json
import os
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from bridge.alarms import Limits
from bridge.clock import Clock, HostClock, StreamClock
from bridge.log.film import MEGABYTE, FilmTerms, FrameFormat
from bridge.monitor import Monitor
from bridge.outlet import Outlet, open_outlet
from bridge.pace import Paced, first_time_ns
from bridge.recorder import Recorder
from bridge.run import Outlets, Steps, close, run
from bridge.settings import Settings
from bridge.settings.terms import terms_of
from bridge.settings.tuning import calibrated_px, tuning_of
from bridge.signing import Seal, open_seal
from bridge.status import StatusLine
from bridge.summary import Summary, to_text
from bridge.telemetry.gauges import names_of
from bridge.telemetry.post import open_post
from bridge.telemetry.snapshot import About
from bridge.telemetry.telemetry import Telemetry
from tools.kept import keep
from tools.open_source import OpenedSource, open_source
from tools.request import Clocks, Pace, RunRequest
from tools.screen import screen
from tools.steady import steady
from tools.summary_file import check_summary_path, write_summary
from tracker.errors import OperatorError
from tracker.pipeline import Tracker
from tracker.rig import Rig
from tracker.sources.uri import parse_source
from tracker.start.paper import PaperTracker
from tracker.types import Event

CALIBRATED_REMEDY = "check colours (`posebridge colours`), marker and that T_BS is camera to room"
NOMINAL_REMEDY = "calibrate the cameras' lenses and the room first (docs/rig.md), then check colours and marker"
TLOG = ".tlog"
LOGGED_PACKAGES = ("posebridge", "numpy", "opencv-python-headless", "filterpy", "pymavlink", "scipy", "mcap")


def run_session(request: RunRequest, clocks: Clocks) -> bool:
    """Fly a source to its end, or to Ctrl-C, which closes links and log in order and is raised again.

    Returns:
        bool: whether the run came to any pose at all.
    Raises:
        OperatorError: a source, link, log or summary that cannot be opened.
        KeyboardInterrupt: the operator ended the run.
    """
    console = screen(stderr=True)
    _check_outputs(request)
    with ExitStack() as stack:
        opened = open_source(request.source, request.settings, clocks)
        stack.enter_context(opened.source)
        for warning in opened.warnings:
            console.print(f"posebridge: warning: {warning}", style="yellow", soft_wrap=True)
        outlet = links_of(request.settings, clocks, logged=request.log is not None)
        stack.callback(outlet.close)
        tracker = tracker_of(request.settings, opened.chosen.rig, clocks)
        recorder = _recorder(request, opened, clocks)
        monitor = Monitor(tuple(camera.name for camera in opened.chosen.rig.cameras))
        status = None if request.quiet else stack.enter_context(StatusLine(console, clocks.stopwatch))
        telemetry = telemetry_of(request.source, request.settings, opened.chosen.rig, monitor, clocks)
        outlets = Outlets(outlet, monitor, recorder, status, telemetry)
        stack.enter_context(steady())
        if request.pace is Pace.FAST:
            opened.reconnect(outlet.inlets())
        events, clock = _paced(opened, request.pace, clocks)  # last: from here on a recording's time runs
        refused = False
        try:
            run(events, tracker, clock, outlets)
        except OperatorError:
            refused = True  # its one line says it all
            raise
        finally:
            close(clock, outlets)
            stack.close()
            if not refused:
                _report(outlets, request, console, opened)
    return monitor.tally().estimates_sent > 0


def _check_outputs(request: RunRequest) -> None:
    """Find out before the flight what could not be written, or would destroy what the run goes by."""
    inputs = parse_source(request.source).files + (() if request.config is None else (request.config,))
    keep(inputs, request.log, "--log")
    if request.summary is not None:
        keep(inputs if request.log is None else (*inputs, request.log), request.summary, "--summary")
        check_summary_path(request.summary)


def _report(outlets: Outlets, request: RunRequest, console: Console, opened: OpenedSource) -> None:
    """Give the run's figures, an interrupted one's too, on stdout; what went wrong on stderr, quiet or not."""
    summary = outlets.summary(None if request.log is None else str(request.log))
    if not request.quiet:
        screen().print(to_text(summary), soft_wrap=True)
    frames = "" if outlets.recorder is None else outlets.recorder.state().frames
    nominal = opened.chosen.nominal
    for trouble in (*opened.troubles(), *_troubles(summary, outlets.monitor.last_rejection, frames, nominal)):
        console.print(f"posebridge: warning: {trouble}", style="yellow", soft_wrap=True)
    if request.summary is not None:
        write_summary(request.summary, summary)


def _troubles(summary: Summary, last_rejection: str, frames: str, nominal: bool) -> Iterator[str]:
    """Yield what the operator must not miss, a line each."""
    if summary.log is not None and summary.log.error:
        yield summary.log.error
    if frames:
        yield frames
    if not summary.estimates_sent:
        why = f"; last: {last_rejection}" if last_rejection else ""
        yield f"no pose was found in any frame{why}; {NOMINAL_REMEDY if nominal else CALIBRATED_REMEDY}"


def tracker_of(settings: Settings, rig: Rig, clocks: Clocks) -> Steps:
    """Make the tracker that the config's method names."""
    tuning = replace(tuning_of(settings.tracker), calibrated_px=calibrated_px(settings))
    made = PaperTracker if settings.tracker.method == "paper" else Tracker
    return made(rig, tuning, clocks.stopwatch)


def links_of(settings: Settings, clocks: Clocks, *, logged: bool = False) -> Outlet:
    """Open the links that the config or the command line names; logged: whether a log is kept of what they say."""
    return open_outlet(
        terms_of(settings, logged=logged),
        component_id=settings.mavlink.component_id,
        room_yaw_deg=settings.room.room_yaw_deg,
        stopwatch=clocks.stopwatch,
        seal=seal_of(settings, clocks),
    )


def seal_of(settings: Settings, clocks: Clocks) -> Seal | None:
    """Open the signing key that the config names, if it names one."""
    key = settings.mavlink.signing_key
    return open_seal(Path(key), clocks.wall, clocks.stopwatch) if key else None


def recorder_of(
    path: Path, settings: Settings, rig: Rig, about: dict[str, str], clocks: Clocks, **how: bool
) -> Recorder:
    """Open the log of a run: the config and what it ran on go into it."""
    versions = {name: _version(name) for name in LOGGED_PACKAGES}
    return Recorder(
        path,
        attachments={"config.json": json.dumps(settings.model_dump(mode="json"), indent=2).encode()},
        metadata={"run": about, "versions": versions, **_vehicle(settings)},
        cameras=rig.cameras,
        marker=rig.marker,
        wall_clock=clocks.wall,
        tlog=tlog_beside(path),
        links=tuple(link.uri for link in settings.links),
        film=film_of(settings),
        **how,
    )


def _vehicle(settings: Settings) -> dict[str, dict[str, str]]:
    """Return the vehicle's sheet as metadata, nothing where the config holds none."""
    if settings.vehicle is None:
        return {}
    return {"vehicle": {key: json.dumps(value) for key, value in settings.vehicle.model_dump(mode="json").items()}}


def tlog_beside(log: Path) -> Path | None:
    """Return where the .tlog of a log goes: beside it; nowhere for a pipe or a device.

    Raises:
        OperatorError: the log itself is named so.
    """
    if log.exists() and not log.is_file():
        return None
    if log.suffix == TLOG:
        raise OperatorError(f"log {log}: a {TLOG} is written beside the MCAP log; name it {log.with_suffix('.mcap')}")
    return log.with_suffix(TLOG)


def film_of(settings: Settings) -> FilmTerms | None:
    """Say how a log keeps frames, None where it keeps none."""
    log = settings.log
    if log.frames == "off":
        return None
    return FilmTerms(FrameFormat(log.frames), round(log.frames_mb * MEGABYTE), log.jpeg_quality)


def telemetry_of(source: str, settings: Settings, rig: Rig, monitor: Monitor, clocks: Clocks) -> Telemetry:
    """Make the telemetry of a run; without a free port it still watches for alarms, and nobody can attach."""
    post = open_post(settings.monitor.port) if settings.monitor.port else None
    about = About(source, _version("posebridge"), os.getpid(), clocks.monotonic())
    limits = Limits(settings.monitor.rate_min_hz, settings.monitor.latency_limit_ms, settings.mavlink.max_age_ms)
    return Telemetry(about, names_of(rig), limits, monitor, post, clocks.stopwatch)


def _recorder(request: RunRequest, opened: OpenedSource, clocks: Clocks) -> Recorder | None:
    if request.log is None:
        return None
    about = {"source": request.source, "pace": request.pace.value, "calibration": opened.chosen.origin.value}
    fast = request.pace is Pace.FAST and not opened.live
    rig = opened.chosen.rig
    return recorder_of(
        request.log, request.settings, rig, about, clocks, overwrite=request.overwrite, block_when_full=fast
    )


def _paced(opened: OpenedSource, pace: Pace, clocks: Clocks) -> tuple[Iterator[Event], Clock]:
    """Return the events and the clock they go by."""
    if opened.live:
        return iter(opened.source), HostClock(clocks.monotonic)
    if pace is Pace.FAST:
        return iter(opened.source), opened.clock or StreamClock()
    start_ns, events = first_time_ns(opened.source)
    clock = HostClock(clocks.monotonic, start_ns)
    return iter(Paced(events, clock, clocks.sleep_s, clocks.stopwatch)), clock


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"
