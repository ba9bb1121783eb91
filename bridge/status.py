"""One line that says how the run goes: rewritten in place on a terminal, rarely repeated elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType, TracebackType
from typing import Self

from rich.console import Console
from rich.live import Live
from rich.text import Text

from bridge.clock import Nanoseconds
from bridge.summary import ClockOffset

REDRAW_NS = 200_000_000
PLAIN_LINE_NS = 5_000_000_000


@dataclass(frozen=True, slots=True)
class Reading:
    """What the status line shows; None for what is not known yet.

    state: the track's state in a word.  rate_hz: estimates sent a second of stream time [Hz].
    latency_p50_ms, latency_p99_ms: frame available to datagram handed over [ms].
    position_m: x, y, z of the body in the room [m].  nis: of the last update, over its degrees of freedom.
    clocks: offsets of the cameras' clocks, those that are certainly not zero, by camera name.
    links_up, links: how many links deliver, of how many.  far_ends: the autopilots there, in a word or two each.
    log: the log's state in a word or two.
    alarm, alarms: the alarm that matters most, "" for none, and how many stand.
    """

    state: str
    rate_hz: float
    latency_p50_ms: float | None
    latency_p99_ms: float | None
    position_m: tuple[float, float, float] | None
    nis: float | None
    links_up: int
    links: int
    log: str
    far_ends: tuple[str, ...] = ()
    clocks: Mapping[str, ClockOffset] = field(default_factory=lambda: MappingProxyType({}))
    alarm: str = ""
    alarms: int = 0


class StatusLine:
    """Show readings no more often than they can be read.

    console: where to; a terminal gets one live line, anything else a plain line every 5 s of stream time.
    stopwatch: reads a monotonic clock [ns]; paces the redrawing on a terminal.
    """

    def __init__(self, console: Console, stopwatch: Nanoseconds) -> None:
        self._console = console
        self._stopwatch = stopwatch
        self._live = Live(console=console, auto_refresh=False, transient=True) if console.is_terminal else None
        self._due_ns: int | None = None

    def __enter__(self) -> Self:
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.stop()

    def show(self, t_ns: int, read: Callable[[], Reading]) -> None:
        """Show the run's state, if it is time for it.

        Args:
            t_ns: stream time [ns].
            read: gives the reading; called only when it will be shown, so it may cost something.
        """
        if self._live is not None:
            if self._is_due(self._stopwatch(), REDRAW_NS):
                self._live.update(_line(read()), refresh=True)
        elif self._is_due(t_ns, PLAIN_LINE_NS):
            self._console.print(_line(read()), soft_wrap=True)

    def _is_due(self, now_ns: int, every_ns: int) -> bool:
        """Say whether a period has passed since the last line; the first period starts at the first call."""
        if self._due_ns is None:
            self._due_ns = now_ns + every_ns
        if now_ns < self._due_ns:
            return False
        self._due_ns = now_ns + every_ns
        return True


def _line(reading: Reading) -> Text:
    position = "-" if reading.position_m is None else " ".join(f"{metres:+.3f}" for metres in reading.position_m)
    clocks = "".join(f"clock {name} {offset} | " for name, offset in reading.clocks.items())
    far_ends = "".join(f" {far_end}" for far_end in reading.far_ends)
    return Text(
        f"{_alarm(reading)}{reading.state:<9} {reading.rate_hz:5.1f} Hz | latency p50 "
        f"{_figure(reading.latency_p50_ms)} p99 {_figure(reading.latency_p99_ms)} ms | "
        f"x y z {position} m | NIS {_figure(reading.nis)} | "
        f"{clocks}links {reading.links_up}/{reading.links}{far_ends} | log {reading.log}",
        overflow="ellipsis",
        no_wrap=True,
    )


def _alarm(reading: Reading) -> str:
    """Put the alarm first: on a narrow terminal the line's end is cut."""
    more = f" (and {reading.alarms - 1} more)" if reading.alarms > 1 else ""
    return f"{reading.alarm}{more} | " if reading.alarm else ""


def _figure(value: float | None) -> str:
    return "-" if value is None else f"{value:.1f}"
