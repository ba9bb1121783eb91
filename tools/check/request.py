"""What `posebridge check` was asked to do."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tracker.errors import OperatorError

SHORTEST_S, LONGEST_S = 3.0, 600.0
NO_SOURCE = "none"


@dataclass(frozen=True, slots=True)
class CheckRequest:
    """One check.

    config: name or path.  source: URI, or `none` to look at the autopilot alone.  link: URI, None for the config's.
    duration_s: how long poses are watched [s].  frame, wiggle: the guided checks.
    apply: write what is wrong; yes: without asking.

    Raises:
        OperatorError: a duration outside 3 to 600 s, or a guided check without cameras.
    """

    config: str
    source: str
    link: str | None
    duration_s: float
    frame: bool
    wiggle: bool
    apply: bool
    yes: bool
    as_json: bool

    def __post_init__(self) -> None:
        if not (math.isfinite(self.duration_s) and SHORTEST_S <= self.duration_s <= LONGEST_S):
            raise OperatorError(
                f"--duration_s: {self.duration_s:g} s must be {SHORTEST_S:g} to {LONGEST_S:g} s; give a length within"
            )
        if self.source == NO_SOURCE and (self.frame or self.wiggle):
            raise OperatorError("--source none: --frame and --wiggle need poses; name the cameras")

    @property
    def has_poses(self) -> bool:
        """Whether the bridge sends poses meanwhile."""
        return self.source != NO_SOURCE
