"""What an identification came to, as JSON and as a page of HTML that needs nothing beside it."""

from __future__ import annotations

import html
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from tools.sysid import pictures
from tools.sysid.certainty import COVERAGE, HIGH_CORRELATION
from tools.sysid.derived import Derived, derived_of
from tools.sysid.identify import Identification
from tools.sysid.log_data import LogData
from tools.sysid.parameters import AXES, INDEX, PARAMETERS
from tools.sysid.validate import OUTPUTS, fit_percent, theil
from tracker.types import Array

MOST_STOPPED = 0.005
NEARLY_REAL = 0.9
"""Damping ratio from where on the lag's pole can hardly be told from the body's."""

_STYLE = """
body { font: 15px/1.5 system-ui, "Segoe UI", Helvetica, Arial, sans-serif; color: #222; margin: 2.2em auto;
  max-width: 68em; padding: 0 1.5em; }
h1 { font-size: 1.6em; margin-bottom: 0.1em; } h2 { font-size: 1.15em; margin: 2em 0 0.4em; color: #1f4e79; }
p.lead { color: #555; margin-top: 0; } table { border-collapse: collapse; font-size: 0.92em; }
th, td { text-align: left; padding: 0.25em 0.9em 0.25em 0; border-bottom: 1px solid #e6e6e6; vertical-align: baseline; }
th { font-weight: 600; border-bottom: 2px solid #bbb; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
td.dim { color: #777; } svg { width: 100%; height: auto; } .warn { color: #b3541e; }
@media print { body { margin: 0; max-width: none; } h2 { break-after: avoid; } svg, table { break-inside: avoid; } }
"""


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """An identification with the log it came from. log: its name."""

    log: str
    read: LogData
    found: Identification

    def warnings(self) -> list[str]:
        """Return what a reader must not miss, a line each."""
        pairs = [f"{one} and {other} {rho:+.2f}" for one, other, rho in self.found.certainty.entangled()]
        lines = []
        if pairs:
            lines.append(
                f"hardly told apart by this flight, their errors correlated: {', '.join(pairs)}; trust their ratio or "
                "sum more than each"
            )
        lines += [
            f"the {axis} stick was at its stop for {share:.0%} of the flight: what the rotor did there is not what the "
            "servos were told; excite it less"
            for axis, share in zip(AXES, self.read.data.stopped(), strict=True)
            if share > MOST_STOPPED
        ]
        lines += [
            f"{parameter.name} = {value:g} stands at its limit: sign or scale of that servo in the sheet is wrong, or "
            "the flight does not show it"
            for parameter, value in zip(PARAMETERS, self.found.theta, strict=True)
            if min(abs(value - parameter.least), abs(value - parameter.most)) < 1e-3 * parameter.scale
        ]
        lines += [
            f"{axis} is damped so strongly that the rotor's lag and the body's poles may have changed places: trust "
            "the response, not these names nor their stated errors"
            for axis in ("roll", "pitch")
            if _damping_ratio(self.found.theta, axis) > NEARLY_REAL
        ]
        lines += [f"the log is damaged: {loss}" for loss in self.read.losses]
        if self.found.whiteness.share < 0.85:
            lines.append(
                f"only {self.found.whiteness.share:.0%} of the residuals' autocorrelations lie in white noise's band: "
                "the model misses something that the flight shows"
            )
        if self.read.servo_hz < 40.0:
            lines.append(f"servos logged at {self.read.servo_hz:.0f} Hz only; ask for 50 Hz ([mavlink] streams_hz)")
        return lines

    def derived(self) -> tuple[Derived, ...]:
        """Return what follows from the parameters."""
        return derived_of(self.found.theta, self.read.vehicle)

    def to_json(self) -> dict[str, Any]:
        """Return all figures."""
        found, sure = self.found, self.found.certainty
        rows = zip(
            PARAMETERS, found.theta, sure.total, sure.chance, sure.bound, found.start, found.learned, strict=True
        )
        return {
            "log": self.log,
            "model": "hover",
            "duration_s": self.read.data.duration_s,
            "tracks": len(self.read.data.tracks),
            "servo_hz": self.read.servo_hz,
            "servo_clock": self.read.clock.name,
            "parameters": {
                p.name: {
                    "symbol": p.symbol,
                    "unit": p.unit,
                    "value": value,
                    "standard_error": total,
                    "interval_95": [value - COVERAGE * total, value + COVERAGE * total],
                    "standard_error_by_chance": chance,
                    "cramer_rao_bound": bound,
                    "start": start,
                    "first_two_thirds": learned,
                }
                for p, value, total, chance, bound, start, learned in rows
            },
            "derived": {each.name: {"unit": each.unit, "value": each.value} for each in self.derived()},
            "correlated": [{"parameters": [one, other], "correlation": rho} for one, other, rho in sure.entangled()],
            "correlation_matrix": sure.correlation.tolist(),
            "held_out": {
                name: {"fit_percent": percent, "theil": inequality}
                for name, percent, inequality in zip(
                    OUTPUTS, fit_percent(found.held_out), theil(found.held_out), strict=True
                )
            },
            "frequency": {
                str(each.axis): {"coherence": each.heard, "cost": each.cost, "band_hz": [each.f_hz[0], each.f_hz[-1]]}
                for each in found.bodes
            },
            "residuals_white_share": found.whiteness.share,
            "warnings": self.warnings(),
        }

    def plain(self) -> Any:
        """Return all figures as JSON can hold them."""
        return as_plain(self.to_json())

    def to_html(self) -> str:
        """Return the page."""
        found, read = self.found, self.read
        percent = fit_percent(found.held_out)
        parts = [
            f"<h1>Hover model of {html.escape(read.vehicle.name)}</h1>",
            f"<p class=lead>{html.escape(self.log)}: {read.data.duration_s:.1f} s in the air in "
            f"{len(read.data.tracks)} part(s), servos at {read.servo_hz:.0f} Hz by {html.escape(read.clock.name)}, "
            f"{read.vehicle.mass_g:g} g. Sources and equations: docs/sysid.md.</p>",
            *(f"<p class=warn>{html.escape(line[0].upper() + line[1:])}.</p>" for line in self.warnings()),
            "<h2>Parameters</h2>", self._parameters(),
            "<p>The standard error holds chance (Cram&eacute;r-Rao, corrected for coloured residuals) and what is "
            "known to be uncertain besides: the clock, whole microseconds, constant coefficients. The truth lies "
            "within the interval in about 95 of 100 flights. Roll, pitch and yaw are about the body's x (forward), "
            "y (left), z (up): positive is right, nose down, nose left.</p>",
            "<h2>What follows from them</h2>", self._derived(),
            "<h2>Measured against modelled, on the last third, which that model has not seen</h2>",
            pictures.held_out_picture(found.held_out, percent), self._held_out(),
            "<h2>Frequency response</h2>", pictures.bode_picture(found.bodes), self._frequency(),
            "<h2>Whitened residuals</h2>", pictures.residual_picture(found.whiteness),
            f"<p>{found.whiteness.share:.0%} of the autocorrelations lie within the band of white noise; 95 % are "
            "expected.</p>",
            "<h2>Sticks, as the servos were told</h2>", pictures.stick_picture(read.data),
            f"<h2>Correlation of the parameters' errors</h2><p>Above {HIGH_CORRELATION} in figures, per cent.</p>",
            f"<div style='max-width:44em'>{pictures.correlation_picture(found.certainty.correlation)}</div>",
        ]  # fmt: skip
        body = "\n".join(parts)
        title = html.escape(f"Hover model of {read.vehicle.name}")
        head = f"<meta charset=utf-8><title>{title}</title>\n<style>{_STYLE}</style>"
        return f"<!doctype html>\n<html lang=en>{head}\n{body}\n</html>\n"

    def _parameters(self) -> str:
        sure = self.found.certainty
        rows = [
            [
                p.name.replace("_", " "), _symbol(p.symbol), *_rounded(value, total),
                f"{100.0 * total / abs(value):.1f} %" if abs(value) > 2.0 * total else "",
                f"{chance:.2g}", _unit(p.unit), html.escape(p.per),
            ]
            for p, value, total, chance in zip(
                PARAMETERS, self.found.theta, sure.total, sure.chance, strict=True
            )
        ]  # fmt: skip
        head = ["parameter", "", "value", "standard error", "", "by chance", "unit", "made of"]
        return _table(head, rows, numbers=(2, 3, 4, 5), dim=(6, 7))

    def _derived(self) -> str:
        rows = [[each.name, f"{each.value:.3g}", _unit(each.unit), html.escape(each.source)] for each in self.derived()]
        return _table(["", "value", "unit", "from"], rows, numbers=(1,), dim=(2, 3))

    def _held_out(self) -> str:
        rows = [
            [name, f"{percent:.0f} %", f"{inequality:.3f}"]
            for name, percent, inequality in zip(
                pictures.OUTPUT_NAMES, fit_percent(self.found.held_out), theil(self.found.held_out), strict=True
            )
        ]
        note = (
            "<p>Modelled from the sticks and the first state alone. Fit: 100 % is perfect, 0 % no better than the "
            "mean; Theil's inequality: 0 is perfect, below 0.3 good. Gusts, which no model can foresee, count "
            "against the speeds.</p>"
        )
        return note + _table(["output", "fit", "Theil"], rows, numbers=(1, 2))

    def _frequency(self) -> str:
        rows = [
            [str(each.axis), f"{each.f_hz[0]:.2g} to {each.f_hz[-1]:.2g} Hz", f"{each.heard:.2f}", f"{each.cost:.0f}"]
            for each in self.found.bodes
        ]
        note = (
            "<p>Pale dots: coherence below 0.6. Mismatch (Tischler and Remple): below 100 good, below 50 excellent.</p>"
        )
        return note + _table(["stick", "band", "coherence", "mismatch"], rows, numbers=(2, 3))


def _damping_ratio(theta: Array, axis: str) -> float:
    stiffness = max(float(theta[INDEX[f"{axis}_stiffness"]]), 1e-9)
    return float(theta[INDEX[f"{axis}_damping"]]) / (2.0 * math.sqrt(stiffness))


def _table(head: list[str], rows: list[list[str]], numbers: tuple[int, ...], dim: tuple[int, ...] = ()) -> str:
    def kind(k: int) -> str:
        return " class=n" if k in numbers else " class=dim" if k in dim else ""

    top = "".join(f"<th{' class=n' if k in numbers else ''}>{text}</th>" for k, text in enumerate(head))
    lines = ("<tr>" + "".join(f"<td{kind(k)}>{cell}</td>" for k, cell in enumerate(row)) + "</tr>" for row in rows)
    return f"<table><tr>{top}</tr>{''.join(lines)}</table>"


def _rounded(value: float, error: float) -> tuple[str, str]:
    """Return both to the error's second digit."""
    if not (math.isfinite(error) and error > 0.0):
        return f"{value:.4g}", "unknown"
    places = max(1 - math.floor(math.log10(error)), 0)
    return f"{value:.{places}f}", f"{error:.{places}f}"


def _symbol(symbol: str) -> str:
    greek = {"tau": "&tau;", "phi": "&phi;", "theta": "&theta;"}
    head, _, tail = symbol.partition("_")
    return f"<i>{greek.get(head, head)}</i><sub>{greek.get(tail, tail)}</sub>"


def _unit(unit: str) -> str:
    return html.escape(unit).replace("^2", "&sup2;")


def as_plain(value: Any) -> Any:
    """Return NumPy's numbers as Python's, those not finite as None, for JSON."""
    if isinstance(value, dict):
        return {key: as_plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [as_plain(each) for each in value]
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value
