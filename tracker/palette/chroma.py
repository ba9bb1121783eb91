"""Colour apart from brightness."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.rig import Colour
from tracker.types import Array, Image

DARK = 16.0  # grey levels: well below this a channel is noise and says nothing of the paint
PLAIN_SATURATION, PLAIN_VALUE = 0.85, 0.7  # of a paint of which only the hue is known
Plane = NDArray[np.float32]


def chroma(bgr: Array | Plane | Image) -> Plane:
    """Return log(red / green), log(blue / green) (..., 2) of colours (..., 3), 0..255.

    A brightness leaves them nearly as they are; a colour cast, gains on the channels, adds nearly the same to all.
    """
    logs = np.log(np.asarray(bgr, dtype=np.float32) + np.float32(DARK))
    return np.stack((logs[..., 2] - logs[..., 1], logs[..., 0] - logs[..., 1]), axis=-1)


def hsv_of(bgr: Image) -> Array:
    """Return hue [deg], saturation and value 0..1 (n, 3) of pixels (n, 3), quantised as the detector sees them."""
    hsv = cv2.cvtColor(np.ascontiguousarray(bgr.reshape(1, -1, 3)), cv2.COLOR_BGR2HSV)[0]
    return np.asarray(hsv * np.array([2.0, 1.0 / 255.0, 1.0 / 255.0]), dtype=np.float64)


def hue_from(hue_deg: Array | float, origin_deg: float) -> Array:
    """Return how far hues lie from an origin, -180 to 180 [deg]."""
    return np.asarray((np.asarray(hue_deg) - origin_deg + 180.0) % 360.0 - 180.0)


def paint_of(colour: Colour) -> Array:
    """Return the bgr (3,) a ball is expected to show: the configured one if it has the configured hue."""
    typical = np.array([[colour.bgr]], dtype=np.uint8)
    hue_deg = float(hsv_of(typical)[0, 0])
    if abs(float(hue_from(hue_deg, colour.hue_deg))) <= colour.hue_tolerance_deg:
        return np.array(colour.bgr, dtype=np.float64)
    hsv = np.array([[[colour.hue_deg, PLAIN_SATURATION, PLAIN_VALUE]]], dtype=np.float32)
    return np.asarray(cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR)[0, 0] * 255.0, dtype=np.float64)
