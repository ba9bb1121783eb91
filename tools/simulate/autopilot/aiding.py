"""How long the filter goes on without a measurement it believes, and what it does then.

Source: ArduPilot's NavEKF3_core::setAidingMode and selectHeightForFusion, 4.7 and 4.8 development.
"""

from __future__ import annotations

LEVEL, HEIGHT, SPEED = "level", "height", "speed"
"""What can be measured: position in the level, height, velocity."""

_LEVEL_WITH_SPEED_MS, _LEVEL_MS = 10_000, 7_000
_HEIGHT_WITH_SPEED_MS, _HEIGHT_MS = 10_000, 5_000
_STOP_MS = 15_000
_FRESH_MS = 500
_FRAME_MS, _LEAST_DELAY_MS, _MOST_DELAY_MS = 12, 60, 250


class Aiding:
    """When each kind of measurement last passed its gate, by the filter's own delayed time."""

    def __init__(self, now_ms: int) -> None:
        self._now_ms = now_ms
        self._passed_ms = dict.fromkeys((LEVEL, HEIGHT, SPEED), now_ms)
        self._has_speed = False

    def advance(self, now_ms: int) -> None:
        """Let time go on."""
        self._now_ms = now_ms

    def note_passed(self, what: str) -> None:
        """Take note that one passed now, or that the filter was reset to it."""
        self._passed_ms[what] = self._now_ms
        self._has_speed |= what == SPEED

    @property
    def lost_level(self) -> bool:
        """Whether position counts as lost: 7 s after anything level was believed, 10 s while velocity still is."""
        since_ms = self._since_ms(LEVEL)
        drifts = min(since_ms, self._since_ms(SPEED)) > _LEVEL_MS
        return since_ms > (_LEVEL_MS if drifts else _LEVEL_WITH_SPEED_MS)

    @property
    def lost_speed(self) -> bool:
        """Whether velocity counts as lost: with position, and only if it is not believed itself."""
        return self.lost_level and self._since_ms(SPEED) > _LEVEL_MS

    @property
    def lost_height(self) -> bool:
        """Whether height counts as lost: 5 s after one was believed, 10 s where velocity is sent as well."""
        with_speed = self._has_speed and not self.lost_speed
        return self._since_ms(HEIGHT) > (_HEIGHT_WITH_SPEED_MS if with_speed else _HEIGHT_MS)

    @property
    def over(self) -> bool:
        """Whether the filter gives up to know its place: 15 s without either."""
        return min(self._since_ms(LEVEL), self._since_ms(SPEED)) > _STOP_MS

    def _since_ms(self, what: str) -> int:
        return self._now_ms - self._passed_ms[what]


def is_fresh(newest_ms: int, now_ms: int) -> bool:
    """Say whether height is vision's: its newest accepted stamp is younger than half a second; else a barometer's."""
    return now_ms - newest_ms < _FRESH_MS


def horizon_ms(delay_ms: float) -> int:
    """Return how far behind the filter runs: at least the barometer's delay, in whole steps, settled at its start.

    A pose that is older when it comes counts as of the horizon.  delay_ms: VISO_DELAY_MS.
    Source: NavEKF3_core::setup_core.
    """
    longest_ms = max(_LEAST_DELAY_MS, min(round(delay_ms), _MOST_DELAY_MS))
    return _FRAME_MS * (longest_ms // _FRAME_MS + 1)
