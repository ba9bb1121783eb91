"""Servo pulses back to sticks: what the autopilot really ordered, by the vehicle's sheet."""

from __future__ import annotations

import numpy as np

from bridge.settings.vehicle import VehicleSettings
from tracker.errors import OperatorError
from tracker.types import Array

_RANK_SHARE = 1e-6


def sticks_of(pulses_us: Array, vehicle: VehicleSettings) -> Array:
    """Return the sticks roll, pitch, yaw, heave about B's axes (n, 4) [of full stick].

    Args:
        pulses_us: pulse of each servo of the sheet, in its order (n, servos).
    Source: pulse = trim + M stick with the sheet's M (servos, 4); sticks are its least squares, exact for any mixing
    swash plate. A stick to the right, nose up, nose right is +, -, - about B's axes (x forward, y left, z up).
    Raises:
        OperatorError: the servos do not tell all four sticks.
    """
    mixing = np.array([[s.right_us, s.nose_up_us, s.nose_right_us, s.up_us] for s in vehicle.servos]).reshape(-1, 4)
    strengths = np.linalg.svd(mixing, compute_uv=False) if len(mixing) >= 4 else np.zeros(4)
    if strengths[-1] <= _RANK_SHARE * strengths[0]:
        raise OperatorError(
            "[[vehicle.servos]]: right, nose up, nose right and up do not all follow from these "
            f"{len(mixing)} servos; add the missing ones to the config (docs/sysid.md)"
        )
    trims_us = np.array([servo.trim_us for servo in vehicle.servos])
    held = (pulses_us - trims_us) @ np.linalg.pinv(mixing).T
    return np.asarray(held * np.array([1.0, -1.0, -1.0, 1.0]))
