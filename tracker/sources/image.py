"""Bytes -> image, and whether an image fits its calibration."""

from __future__ import annotations

import cv2
import numpy as np

from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.types import Image

_JPEG_START, _JPEG_END = b"\xff\xd8", b"\xff\xd9"
_PNG_START, _PNG_END = b"\x89PNG", b"IEND"


def decode_image(data: bytes) -> Image | None:
    """Decode an image file's bytes.

    Returns:
        (height, width, 3) BGR, 8 bit, read-only; None if the bytes are no whole image. A file cut short is none:
        decoders fill its rest with grey, and a ball cut by that edge would be seen aside of its centre.
    """
    if _is_cut_short(data):
        return None
    try:
        image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_COLOR)
    except cv2.error:
        return None
    return None if image is None else frozen_image(image)


def frozen_image(image: cv2.typing.MatLike) -> Image:
    """Return the image as 8 bit, made read-only in place."""
    frozen = np.asarray(image, dtype=np.uint8)
    frozen.flags.writeable = False
    return frozen


def size_px(image: Image) -> tuple[int, int]:
    """Return (width, height) of an image [px]."""
    return image.shape[1], image.shape[0]


def check_first_size(where: str, image: Image, camera: Camera) -> None:
    """Refuse a stream whose very first image has another size than its calibration.

    Raises:
        OperatorError: the sizes differ.
    """
    width, height = size_px(image)
    if (width, height) != (camera.width_px, camera.height_px):
        raise OperatorError(
            f"{where}: images are {width} x {height} px, the calibration of {camera.name} is for "
            f"{camera.width_px} x {camera.height_px} px; record at that size or calibrate at this one"
        )


def _is_cut_short(data: bytes) -> bool:
    if not data:
        return True
    # Some cameras pad a JPEG with zeros up to a whole packet.
    if data.startswith(_JPEG_START):
        return not data.rstrip(b"\0").endswith(_JPEG_END)
    return data.startswith(_PNG_START) and _PNG_END not in data[-12:]
