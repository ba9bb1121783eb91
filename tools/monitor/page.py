"""One snapshot laid out for a terminal: what matters most stands first, so a low window loses the least."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from rich.console import Console, ConsoleOptions, Group, RenderableType, RenderResult
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from bridge.alarms import Alarm, Level
from bridge.telemetry.compose import EDGES_MS
from bridge.telemetry.snapshot import Calibration, CameraView, Nis, Snapshot, Stage
from bridge.wire import LinkState
from tools.monitor.bars import BLOCKS, bars

LABEL = 9  # characters of the column of labels
BARS = 30
GOOD, BAD, CAREFUL, QUIET = "green", "bold red", "yellow", "dim"
STATE_STYLES = {"tracking": GOOD, "lost": BAD}


def page(snapshot: Snapshot, where: str, note: str = "", glyphs: str = BLOCKS) -> RenderableType:
    """Lay a snapshot out.

    Args:
        where: the address or file that it comes from.
        note: what the monitor itself has to say, "" for nothing.
        glyphs: see `bars`.
    """
    return Group(
        _title(snapshot, where),
        *([Text(note, CAREFUL)] if note else ()),
        *_alarms(snapshot.alarms),
        _track(snapshot),
        *_pose(snapshot),
        _rate(snapshot, glyphs),
        _nis(snapshot.nis),
        _calibration(snapshot.calibration),
        _latency(snapshot, glyphs),
        *(_camera(camera, snapshot.balls) for camera in snapshot.cameras),
        *_links(snapshot),
        *_log(snapshot),
        *_rejected(snapshot),
    )


def figure(value: float | None, digits: int = 1) -> str:
    """Return a number as it is shown, a dash for none."""
    return "-" if value is None else f"{value:.{digits}f}"


@dataclass(frozen=True, slots=True)
class _Illustrated:
    """A text, and bars behind it as far as its line has room for them."""

    text: Text
    bars: str

    def __rich_console__(self, _: Console, options: ConsoleOptions) -> RenderResult:
        room = max(0, options.max_width - self.text.cell_len)
        yield Text.assemble(self.text, self.bars[:room])

    def __rich_measure__(self, _: Console, options: ConsoleOptions) -> Measurement:
        return Measurement(1, min(options.max_width, self.text.cell_len + len(self.bars)))


def _row(label: str, *parts: str | tuple[str, str] | Text, bars: str = "", style: str = QUIET) -> Table:
    """Put a label before a text, which goes on below itself where the window is narrow, and bars behind it."""
    row = Table.grid()
    row.add_column(min_width=LABEL, no_wrap=True)
    row.add_column(overflow="fold")
    row.add_row(Text(label, style), _Illustrated(Text.assemble(*parts), bars))
    return row


def _title(snapshot: Snapshot, where: str) -> Text:
    about, running_s = snapshot.about, round(snapshot.running_s)
    clock = f"{running_s // 3600}:{running_s // 60 % 60:02d}:{running_s % 60:02d}"
    version = f" {about.version}" if about.version else ""
    ended = (" ended", CAREFUL) if snapshot.ended else ("", "")
    line = Text.assemble((f"posebridge{version}", "bold"), f"  {about.source}  {clock}", ended, (f"  {where}", QUIET))
    line.no_wrap, line.overflow = True, "ellipsis"
    return line


def _alarms(alarms: Sequence[Alarm]) -> Iterator[RenderableType]:
    if not alarms:
        yield _row("alarms", ("none", GOOD))
    for alarm in alarms:
        style = BAD if alarm.level is Level.ALARM else CAREFUL
        yield _row(alarm.level.upper(), alarm.cause, (f"  {alarm.since_s:.0f} s", QUIET), style=style)
        yield _row("", ("-> " + alarm.remedy, QUIET))


def _track(snapshot: Snapshot) -> Table:
    track = snapshot.track
    return _row(
        "track",
        (track.state, STATE_STYLES.get(track.state, CAREFUL)),
        f" for {track.state_s:.0f} s, lost {track.lost} times, {track.resets} resets",
    )


def _pose(snapshot: Snapshot) -> Iterator[Table]:
    pose, tracking = snapshot.pose, snapshot.track.state == "tracking"
    if pose is None:
        return
    old = ("", "") if tracking else (", WHEN LAST SEEN", CAREFUL)
    metres = " ".join(f"{value:+.3f}" for value in pose.position_m)
    sigmas = " ".join(f"{1e3 * value:.2f}" for value in pose.position_sigma_m)
    yield _row("position", f"x y z {metres} m, sigma {sigmas} mm, speed {pose.speed_m_s:.2f} m/s", old)
    degrees = " ".join(f"{value:+.1f}" for value in pose.euler_deg)
    sigmas = " ".join(f"{value:.2f}" for value in pose.attitude_sigma_deg)
    yield _row("attitude", f"roll pitch yaw {degrees} deg, sigma {sigmas} deg", old)


def _rate(snapshot: Snapshot, glyphs: str) -> Table:
    rate = snapshot.rate
    slow = snapshot.track.state == "tracking" and rate.now_hz < 0.97 * rate.need_hz
    return _row(
        "rate",
        (f"{rate.now_hz:.1f} Hz", BAD if slow else ""),
        f" (mean {rate.mean_hz:.1f}, needed {rate.need_hz:g}), ",
        f"gap {figure(rate.gap_recent_ms, 0)} ms (ever {figure(rate.gap_ever_ms, 0)}), ",
        f"age {figure(rate.age_ms, 0)} ms ",
        bars=bars(snapshot.history.poses, BARS // 2, glyphs),
    )


def _nis(nis: Nis) -> Table:
    if nis.mean_ratio is None or nis.low is None or nis.high is None:
        return _row("NIS", "-")
    inside = nis.low <= nis.mean_ratio <= nis.high
    verdict = "as the covariance says" if inside else "too cautious" if nis.mean_ratio < nis.low else "too sure"
    return _row("NIS", f"{nis.mean_ratio:.2f}, 95 % of true filters {nis.low:.2f} to {nis.high:.2f}: {verdict}")


def _calibration(held: Calibration) -> Table:
    if held.epipolar_px is None or held.spacing_mm is None:
        return _row("cameras", (held.wrong or "-", BAD if held.wrong else ""))
    verdict = (held.wrong, BAD) if held.wrong else ("stand as they did", GOOD)
    return _row(
        "cameras", verdict, f", rays miss by {held.epipolar_px:.2f} px, balls apart within {held.spacing_mm:.2f} mm"
    )


def _latency(snapshot: Snapshot, glyphs: str) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style=QUIET)
    table.add_column("latency, ms", no_wrap=True)
    for column in ("p50", "p95", "p99", "max"):
        table.add_column(column, justify="right", no_wrap=True)
    table.add_column(_cropped(f"{EDGES_MS[0]:g} ms .. {EDGES_MS[-1] / 1e3:g} s"))  # it alone gives way
    for stage in (*snapshot.latency.stages, snapshot.latency.total):
        table.add_row(*_figures(stage), _cropped(bars(stage.counts, BARS, glyphs)))
    history = _cropped(bars(snapshot.history.latency_ms, BARS, glyphs))
    recent = (figure(snapshot.latency.recent_p50_ms, 2), "", figure(snapshot.latency.recent_p99_ms, 2), "")
    table.add_row("now; by second", *recent, history)
    return table


def _cropped(line: str) -> Text:
    return Text(line, no_wrap=True, overflow="crop")


def _figures(stage: Stage) -> tuple[str, ...]:
    spread = stage.spread_ms
    return (stage.name, *(figure(value, 2) for value in (spread.p50, spread.p95, spread.p99, spread.max)))


def _camera(camera: CameraView, balls: Sequence[str]) -> Table:
    seen = ", ".join(f"{ball} {share:.0%}" for ball, share in zip(balls, camera.seen, strict=False))
    clock = ""
    if camera.clock_offset_ms is not None and camera.clock_sigma_ms:
        clock = f", clock {camera.clock_offset_ms:+.2f} +- {camera.clock_sigma_ms:.2f} ms"
    room = f", room {camera.room} {camera.room_shift_px:.2f} px" if camera.room else ""
    return _row(camera.name, f"{camera.rate_hz:.1f} Hz, saw {seen}{clock}{room}")


def _links(snapshot: Snapshot) -> Iterator[Table]:
    for place, link in enumerate(snapshot.links):
        yield _row("link", *_link(link))
        if place < len(snapshot.far_ends):
            yield _row("", str(snapshot.far_ends[place]))


def _link(link: LinkState) -> Iterator[str | tuple[str, str]]:
    yield f"{link.name} "
    yield ("up", GOOD) if link.up else (f"down, {link.reason}", BAD)
    superseded = f", {link.superseded} superseded" if link.superseded else ""
    yield f", {link.sent} sent, {link.dropped} dropped{superseded}"


def _log(snapshot: Snapshot) -> Iterator[Table]:
    log = snapshot.log
    if log is None:
        yield _row("log", "off")
        return
    trouble = f" STOPPED: {log.error}" if log.error else f", {log.dropped} steps dropped" if log.dropped else ""
    yield _row("log", f"{log.path} {log.size_bytes / 1e6:.1f} MB", (trouble, BAD))


def _rejected(snapshot: Snapshot) -> Iterator[Table]:
    if snapshot.rejected:
        yield _row("left out", ", ".join(f"{reason} {count}" for reason, count in snapshot.rejected.items()))
