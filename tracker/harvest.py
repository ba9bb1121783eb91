"""What the rounds of one step of the tracker gave so far."""

from __future__ import annotations

from dataclasses import dataclass, field

from tracker.standing import Health
from tracker.types import BallSighting, Estimate, Rejected


@dataclass(slots=True, eq=False)
class Harvest:
    """What the rounds of one step gave so far.

    refused: sightings that did not fit.  health: of the calibration, where there is news of it.
    find_ns, filter_ns: time that looking for balls and updating by them took, since the last estimate [ns].
    """

    sightings: list[BallSighting] = field(default_factory=list)
    rejections: list[Rejected] = field(default_factory=list)
    estimates: list[Estimate] = field(default_factory=list)
    refused: list[BallSighting] = field(default_factory=list)
    health: Health | None = None
    find_ns: int = 0
    filter_ns: int = 0

    def add(self, tried: Harvest) -> None:
        """Take over what an attempt gave that counts."""
        self.sightings += tried.sightings
        self.rejections += tried.rejections
        self.estimates += tried.estimates
        self.refused += tried.refused
        self.find_ns += tried.find_ns
        self.filter_ns += tried.filter_ns

    def stages(self, wait_ns: int, took_ns: int) -> dict[str, int]:
        """Return what each stage took of a round's time [ns]; what is neither `find` nor `filter` is `track`."""
        rest_ns = took_ns - self.find_ns - self.filter_ns
        return {"wait": wait_ns, "find": self.find_ns, "filter": self.filter_ns, "track": rest_ns}
