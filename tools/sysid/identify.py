"""One identification from data to verdict."""

from __future__ import annotations

from dataclasses import dataclass

from tools.sysid.certainty import Certainty, certainty
from tools.sysid.fit import Fit, fit, fit_starts
from tools.sysid.flight_data import FlightData
from tools.sysid.frequency import LEAST_COHERENCE, Bode, bode
from tools.sysid.parameters import AXES
from tools.sysid.start import starting_point
from tools.sysid.validate import Comparison, Whiteness, compare, whiteness
from tracker.errors import OperatorError
from tracker.types import Array

LEARNED_SHARE = 2.0 / 3.0
"""The part of the flight that the model for the hold-out figures learns from."""


@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """What came of it.

    start: equation error's parameters.  fit, certainty: from the whole flight.
    learned: parameters from the first two thirds.  held_out: these on the last third, which they have not seen.
    """

    start: Array
    fit: Fit
    certainty: Certainty
    learned: Array
    held_out: list[Comparison]
    bodes: tuple[Bode, ...]
    whiteness: Whiteness

    @property
    def theta(self) -> Array:
        """Return the parameters."""
        return self.fit.unknowns.theta


def identify(data: FlightData, clock_s: float, pulse_step: float) -> Identification:
    """Fit the hover model to a flight.

    Args:
        data: the flight.  clock_s, pulse_step: see `certainty`.
    Raises:
        OperatorError: a stick that hardly moved, or whose answer drowns.
    """
    start = starting_point(data)
    for axis in AXES:
        seen = bode(axis, start, data)
        if seen.heard < LEAST_COHERENCE:
            raise OperatorError(
                f"sysid: the {axis} stick explains too little of the motion, coherence {seen.heard:.2f}, at least "
                f"{LEAST_COHERENCE} is needed; fly a plan of `posebridge excite` with more {axis} in it"
            )
    early, late = data.split(LEARNED_SHARE)
    if not early.tracks or not late.tracks:
        raise OperatorError("sysid: the flight is in too many short pieces; fly it again without losing the track")
    learned = fit(start, early)
    starts = fit_starts(learned.unknowns.theta, late, learned.noise)
    held_out = compare(learned.unknowns.theta, starts.starts, late)
    whole = fit(learned.unknowns.theta, data, learned.noise)
    theta = whole.unknowns.theta
    return Identification(
        start,
        whole,
        certainty(whole, clock_s, pulse_step),
        learned.unknowns.theta,
        held_out,
        tuple(bode(axis, theta, data) for axis in AXES),
        whiteness(whole.left),
    )
