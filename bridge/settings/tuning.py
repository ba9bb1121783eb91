"""The config's [tracker] section as the tracker takes it."""

from __future__ import annotations

import math

from bridge.settings.models import Settings
from bridge.settings.tracking import TrackerSettings
from tracker.state import Process
from tracker.tuning import Tuning

NS_PER_MS = 1e6


def tuning_of(settings: TrackerSettings) -> Tuning:
    """Turn milliseconds into nanoseconds and sections into the tracker's own values."""
    process = settings.process
    return Tuning(
        process=Process(
            acceleration_m_s2=process.acceleration_m_s2,
            angular_acceleration_rad_s2=process.angular_acceleration_rad_s2,
            manoeuvre_s=process.manoeuvre_ms * 1e-3,
            initial_speed_m_s=process.initial_speed_m_s,
            initial_rate_rad_s=process.initial_rate_rad_s,
            tilt_rad=math.radians(process.tilt_deg),
            tilt_s=process.tilt_ms * 1e-3,
            clock_offset_s=settings.clock_offset_sigma_ms * 1e-3,
            pixel_noise_px=settings.pixel_noise_px,
        ),
        gate_probability=settings.gate_probability,
        sync_window_ns=round(settings.sync_window_ms * NS_PER_MS),
        coast_limit_ns=round(settings.coast_limit_ms * NS_PER_MS),
        continuity_limit_ns=round(settings.continuity_limit_ms * NS_PER_MS),
        tilt_limit_rad=math.radians(settings.tilt_limit_deg),
        lag_rounds=settings.lag_rounds,
    )


def calibrated_px(settings: Settings) -> float | None:
    """Return by how much balls missed when the room was calibrated [px]; None where its cameras do not count."""
    measured = settings.rig.measured
    if measured is None or settings.rig.calibration or measured.reprojection_px < 0.0:  # below 0: not measured
        return None
    return measured.reprojection_px
