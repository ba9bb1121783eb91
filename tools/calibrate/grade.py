"""How good a calibration is to fly by."""

from __future__ import annotations

from enum import StrEnum


class Grade(StrEnum):
    """How good."""

    GOOD = "good"
    USABLE = "usable"
    NOT_GOOD = "not good"
