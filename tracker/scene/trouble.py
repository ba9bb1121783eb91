"""What may go wrong with a simulated picture."""

from __future__ import annotations

from dataclasses import dataclass

from tracker.scene.ball import Bgr
from tracker.scene.thing import Bar, Sphere


@dataclass(frozen=True, slots=True)
class Occluder:
    """A flat thing held before one camera: an upright rectangle in its image [px] and its colour."""

    camera: int
    u_px: int
    v_px: int
    width_px: int
    height_px: int
    bgr: Bgr = (60, 60, 60)


@dataclass(frozen=True, slots=True)
class Knock:
    """A camera that was moved, by index.

    turn_deg: about its own axes x (right), y (down) and z (ahead).  shift_mm: along them, as they were.
    """

    camera: int
    turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shift_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Trouble:
    """What spoils a picture on purpose.

    light_gain: factor on all light; 0.2 is a blind drawn, 2 a lamp switched on, 0.5 an exposure halved.
    gains_bgr: factors on the light of each channel: lamps of another colour, or a white balance that drifts.
    occluders: things held before the cameras.
    knocks: cameras that no longer stand where they did.
    things: what else stands or moves in the room, the same for all cameras.
    repainted: balls of the marker, by index, that show another colour.
    broken_from: share of the image's height from which on its rows are garbage, as a damaged JPEG gives; 1 for none.
    """

    light_gain: float = 1.0
    gains_bgr: tuple[float, float, float] = (1.0, 1.0, 1.0)
    occluders: tuple[Occluder, ...] = ()
    knocks: tuple[Knock, ...] = ()
    things: tuple[Sphere | Bar, ...] = ()
    repainted: tuple[tuple[int, Bgr], ...] = ()
    broken_from: float = 1.0

    @property
    def gain_bgr(self) -> tuple[float, float, float]:
        """Return the factor on each channel's light."""
        blue, green, red = (self.light_gain * gain for gain in self.gains_bgr)
        return blue, green, red


NO_TROUBLE = Trouble()
AS_LIT = NO_TROUBLE.gain_bgr
