"""How the simulated room is lit and seen."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Lamp:
    """A lamp that hangs in the room at p_inW [m], its light the same to all sides.

    share: of light that it throws on what faces it at W's origin; it falls with the distance squared.
    """

    p_inW: tuple[float, float, float]
    share: float


@dataclass(frozen=True, slots=True)
class Look:
    """Light, lens and sensor of every simulated camera.

    Values were set beside the lab recordings: balls of 5 to 6 px, noise of 2 to 3 levels of 255.
    lamp_inW: direction towards the main lamp, any length: far away, a window or the sky.
    ambient, diffuse: shares of light from everywhere, and from the main lamp.
    specular: share of the light that the paint mirrors of the main lamp; of others in proportion.
    lamps: further ones, near enough that the light differs by place.
    blur_px: one sigma of the lens's point spread [px].
    exposure_s: time the shutter is open [s].  sub_exposures: instants it is split into; 1 freezes the motion.
    full_well_e: electrons of a white pixel; their square root is the shot noise.
    read_noise: one sigma of the read-out, as a share of white.
    chroma_noise: share of the noise's deviation that is not common to the three channels, 0..1.
    jpeg_quality: 1..100 for a JPEG round trip with chroma at half size, as USB cameras give; 0 for none.
    gamma: grey levels go with light to the power 1 / gamma: 2.2 as cameras make pictures for screens; 1.0 linear, where
        ball and room mix in grey levels as they do in light.
    """

    lamp_inW: tuple[float, float, float] = (0.35, -0.25, 0.9)
    ambient: float = 0.42
    diffuse: float = 0.80
    specular: float = 0.15
    lamps: tuple[Lamp, ...] = ()
    blur_px: float = 0.5
    exposure_s: float = 0.004
    sub_exposures: int = 5
    full_well_e: float = 3000.0
    read_noise: float = 0.0010
    chroma_noise: float = 0.5
    jpeg_quality: int = 0
    gamma: float = 2.2

    @property
    def glossiness(self) -> float:
        """Return what the paint mirrors of a lamp beside what it throws back matt."""
        return self.specular / self.diffuse if self.diffuse > 0.0 else 0.0

    @property
    def on_average(self) -> float:
        """Return the light that falls on a piece of any direction about W's origin."""
        return self.ambient + 0.5 * (self.diffuse + sum(lamp.share for lamp in self.lamps))
