"""Which pixels have a ball's colour."""

from __future__ import annotations

import cv2
import numpy as np

from tracker.image.colour_table import HUE_STEPS
from tracker.rig import Colour
from tracker.types import Image


def colour_mask(hsv: Image, colour: Colour) -> Image:
    """Return the mask (height, width), 255 where an HSV image has the colour; hues wrap round at 360 deg."""
    low = round((colour.hue_deg - colour.hue_tolerance_deg) / 2.0)
    high = round((colour.hue_deg + colour.hue_tolerance_deg) / 2.0)
    saturation, value = round(colour.saturation_min * 255), round(colour.value_min * 255)
    spans = [(max(low, 0), min(high, HUE_STEPS - 1))]
    if low < 0:
        spans.append((low + HUE_STEPS, HUE_STEPS - 1))
    if high >= HUE_STEPS:
        spans.append((0, high - HUE_STEPS))
    masks = [cv2.inRange(hsv, (first, saturation, value), (last, 255, 255)) for first, last in spans]
    return np.asarray(masks[0] if len(masks) == 1 else cv2.bitwise_or(masks[0], masks[1]), dtype=np.uint8)
