"""One line that says how the run goes: rewritten in place on a terminal, rarely repeated elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
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
BETWEEN = " | "


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

    console: where to; a terminal gets a live line, broken where it does not fit, anything else a plain one every 5 s of
        stream time.
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
                self._live.update(Text(_laid_out(_parts(read()), self._console.width)), refresh=True)
        elif self._is_due(t_ns, PLAIN_LINE_NS):
            self._console.print(Text(BETWEEN.join(_parts(read()))), soft_wrap=True)

    def _is_due(self, now_ns: int, every_ns: int) -> bool:
        """Say whether a period has passed since the last line; the first period starts at the first call."""
        if self._due_ns is None:
            self._due_ns = now_ns + every_ns
        if now_ns < self._due_ns:
            return False
        self._due_ns = now_ns + every_ns
        return True


def _parts(reading: Reading) -> list[str]:
    """Return what the line says, part by part, an alarm first."""
    position = "-" if reading.position_m is None else " ".join(f"{metres:+.3f}" for metres in reading.position_m)
    more = f" (and {reading.alarms - 1} more)" if reading.alarms > 1 else ""
    return [
        *([f"{reading.alarm}{more}"] if reading.alarm else ()),
        f"{reading.state:<9} {reading.rate_hz:5.1f} Hz",
        f"latency p50 {_figure(reading.latency_p50_ms)} p99 {_figure(reading.latency_p99_ms)} ms",
        f"x y z {position} m",
        f"NIS {_figure(reading.nis)}",
        *(f"clock {name} {offset}" for name, offset in reading.clocks.items()),
        " ".join((f"links {reading.links_up}/{reading.links}", *reading.far_ends)),
        f"log {reading.log}",
    ]


def _laid_out(parts: Sequence[str], width: int) -> str:
    """Join parts to lines that fit; a part longer than a line is left for the terminal to wrap."""
    lines: list[str] = []
    for part in parts:
        if lines and len(lines[-1]) + len(BETWEEN) + len(part) <= width:
            lines[-1] += BETWEEN + part
        else:
            lines.append(part)
    return "\n".join(lines)


def _figure(value: float | None) -> str:
    return "-" if value is None else f"{value:.1f}"
