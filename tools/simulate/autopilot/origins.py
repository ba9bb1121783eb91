"""Where the autopilot's north-east-down axes lie on the globe, and which origin it takes."""

from __future__ import annotations

from dataclasses import dataclass

CORES_MS, INITIALISED_MS = 3300, 4200
"""Times after boot: the filter has memory; it runs."""


@dataclass(frozen=True, slots=True)
class Origin:
    """Where N's origin lies: 1e-7 deg and mm, as on the wire."""

    latitude: int
    longitude: int
    altitude_mm: int


class Origins:
    """Take the first origin, once.

    promised: the one it says it has.  kept: the one it has.
    Between `CORES_MS` and `INITIALISED_MS` an origin is acknowledged and lost, and every later one refused: ArduPilot
    remembers there that it has one, and the start of its cores forgets which.
    """

    def __init__(self) -> None:
        self.promised: Origin | None = None
        self.kept: Origin | None = None

    def take(self, origin: Origin, now_ms: int) -> bool:
        """Take one at this time after boot; say whether it is acknowledged."""
        nothing = origin.latitude == 0 and origin.longitude == 0
        if nothing or now_ms < CORES_MS or self.promised is not None:
            return False
        self.promised = origin
        if now_ms >= INITIALISED_MS:
            self.kept = origin
        return True
