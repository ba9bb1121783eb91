"""Rooms nobody planned: another light, lens and sensor for each seed, within what rooms and cameras indoors have."""

from __future__ import annotations

import numpy as np

from tracker.scene.look import Lamp, Look

LAMPS = 3  # at most, besides the main one
ASIDE_M, ABOVE_M = 2.0, (1.0, 2.2)  # where they hang, from W's origin
MAIN_ELEVATION_DEG = (15.0, 85.0)
BRIGHTNESS = (0.55, 0.90)  # on average over a ball: a sensible exposure, balls neither full nor dim
GLOSSINESS = (0.0, 0.25)  # satin paint
AMBIENT_SHARE = (0.25, 0.65)  # of that


def random_look(seed: int, gamma: float) -> Look:
    """Make up a room's light and its cameras' lens and sensor. gamma: of the cameras.

    A main lamp or window far away on any side, up to LAMPS lamps that hang near, light that walls throw back, paint
    more or less glossy; a lens more or less sharp, and a sensor more or less noisy.
    """
    rng = np.random.default_rng((seed, 0x1161))
    brightness = rng.uniform(*BRIGHTNESS)
    ambient = brightness * rng.uniform(*AMBIENT_SHARE)
    shares = 2.0 * (brightness - ambient) * rng.dirichlet(np.ones(1 + int(rng.integers(LAMPS + 1))))
    azimuth, elevation = rng.uniform(0.0, 2.0 * np.pi), np.radians(rng.uniform(*MAIN_ELEVATION_DEG))
    main = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    return Look(
        lamp_inW=tuple(main.tolist()),
        ambient=float(ambient),
        diffuse=float(shares[0]),
        specular=float(rng.uniform(*GLOSSINESS) * shares[0]),
        lamps=tuple(Lamp(_hung(rng), float(share)) for share in shares[1:]),
        blur_px=float(rng.uniform(0.35, 0.8)),
        exposure_s=float(rng.uniform(0.002, 0.006)),
        full_well_e=float(rng.uniform(1500.0, 6000.0)),
        read_noise=float(rng.uniform(0.0005, 0.003)),
        gamma=gamma,
    )


def _hung(rng: np.random.Generator) -> tuple[float, float, float]:
    """Hang a lamp somewhere above the room's middle, p_inW [m]."""
    x, y = rng.uniform(-ASIDE_M, ASIDE_M, 2).tolist()
    return x, y, float(rng.uniform(*ABOVE_M))
