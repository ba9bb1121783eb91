"""From light to the eight bits a camera gives: noise, gamma, quantisation, JPEG."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.scene.look import Look
from tracker.types import Image

Plane = NDArray[np.float32]

_LEVELS = 1 << 14
_BANK_MARGIN_PX = 96


def to_light(display: Image | Plane, gamma: float) -> Plane:
    """Return the light, 0..1, behind display values 0..255 of a camera's gamma."""
    return np.asarray((np.asarray(display, dtype=np.float32) / 255.0) ** gamma, dtype=np.float32)


class Sensor:
    """One camera's sensor. The noise belongs to the light; it is carried through the gamma to first order:

        s(L) = d display / dL * sqrt(L / full_well + read^2),   display = 255 L^(1/gamma)

    so that a still backdrop costs one multiply and one add a frame. The unit noise comes from a bank made once
    and cut out at a random place for each frame.
    """

    def __init__(self, width_px: int, height_px: int, look: Look, rng: np.random.Generator) -> None:
        self._size = (height_px, width_px)
        self._look = look
        self._rng = rng
        light = (np.arange(_LEVELS, dtype=np.float64) / (_LEVELS - 1)).clip(0.25 / _LEVELS)
        slope = 255.0 / look.gamma * light ** (1.0 / look.gamma - 1.0)
        sigma = slope * np.sqrt(light / look.full_well_e + look.read_noise**2)
        self._display = (255.0 * light ** (1.0 / look.gamma)).astype(np.float32)
        self._sigma = np.minimum(sigma, 6.0).astype(np.float32)
        self._bank = self._noise_bank()
        self._product = np.empty((height_px, width_px, 3), dtype=np.float32)

    def develop(self, light: Plane) -> tuple[Plane, Plane]:
        """Turn light (h, w, 3) into display values and the noise's one sigma, both (h, w, 3)."""
        index = (light * (_LEVELS - 1) + 0.5).clip(0, _LEVELS - 1).astype(np.int32)
        return self._display[index], self._sigma[index]

    def next_noise(self) -> Plane:
        """Return a frame's unit noise (h, w, 3), a view of the bank."""
        v, u = self._rng.integers(0, _BANK_MARGIN_PX, size=2)
        return self._bank[v : v + self._size[0], u : u + self._size[1]]

    def expose(self, display: Plane, sigma: Plane, noise: Plane) -> Image:
        """Add the noise and quantise to eight bits."""
        product = self._product[: display.shape[0], : display.shape[1]]
        cv2.multiply(sigma, noise, product)
        image: Image = cv2.add(display, product, dtype=cv2.CV_8U).astype(np.uint8, copy=False)
        return image

    def compress(self, image: Image) -> Image:
        """Send the image through JPEG, if the look asks for it."""
        if not self._look.jpeg_quality:
            return image
        options = [cv2.IMWRITE_JPEG_QUALITY, self._look.jpeg_quality]
        options += [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420]
        decoded = cv2.imdecode(cv2.imencode(".jpg", image, options)[1], cv2.IMREAD_COLOR)
        return np.asarray(decoded, dtype=np.uint8)

    def _noise_bank(self) -> Plane:
        """Make unit noise, partly common to the three channels as demosaicing leaves it."""
        height, width = self._size[0] + _BANK_MARGIN_PX, self._size[1] + _BANK_MARGIN_PX
        share = self._look.chroma_noise
        common = self._rng.standard_normal((height, width, 1), dtype=np.float32)
        own = self._rng.standard_normal((height, width, 3), dtype=np.float32)
        return np.asarray(np.sqrt(1.0 - share**2) * common + share * own, dtype=np.float32)
