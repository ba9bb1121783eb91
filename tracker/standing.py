"""What is known of the cameras' stand, as it travels with a step of the tracker."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

TOO_BRIGHT = 0.4  # of a ball's pixels, too bright for the camera: beyond, it teaches nothing of the light


class Witness(StrEnum):
    """What the room behind the vehicle tells of a camera."""

    LEARNING = "learning"  # it has not yet been seen for long enough
    STILL = "still"  # it stands where it stood, and so does the camera
    MOVED = "moved"  # the camera does not
    BLIND = "blind"  # too little of it to tell, or too much of it is covered


@dataclass(frozen=True, slots=True)
class CameraHealth:
    """Whether one camera stands where it stood when the flight began, and there where the room file has it; its light.

    moved: beyond doubt it does not.  witness: what the room says.  shift_px: how far the room has moved in its
    picture, at the corner where that is most [px].  at_vehicle_mm: how far such a shift moves a ball that only this
    camera sees [mm].  Both 0 where not known.  full_share: of its balls' pixels, those too bright for it, 0..1.
    """

    name: str
    moved: bool
    witness: Witness
    shift_px: float = 0.0
    at_vehicle_mm: float = 0.0
    full_share: float = 0.0


@dataclass(frozen=True, slots=True)
class Health:
    """Whether the calibration still holds.

    t_ns: when that was judged, stream time [ns].
    at_odds: the rays to the balls say that some camera has moved, and nothing tells which.
    from_start: they said so from the beginning: it does not stand where the room file has it.
    epipolar_px: how far a ball lies off the plane of the other camera's ray, rms over pairs of cameras [px].
    spacing_mm: how far the balls stand from their distances on the marker, rms [mm].  Both None where no two cameras
        see the marker.
    """

    t_ns: int
    cameras: tuple[CameraHealth, ...]
    at_odds: bool = False
    epipolar_px: float | None = None
    spacing_mm: float | None = None
    from_start: bool = False

    @property
    def brief(self) -> str:
        """What is wrong in a few words, "" for nothing."""
        moved = [camera.name for camera in self.cameras if camera.moved]
        if not moved and not self.at_odds:
            return ""
        who = " ".join(moved) or "a camera"
        return f"{who} not as calibrated: do not fly" if self.from_start else f"{who} moved, poses poor: land"
