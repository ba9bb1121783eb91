"""The config's [tracker] section."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, Strict, model_validator

from bridge.settings.section import NotNegative, Positive, Section

MOST_LAG_ROUNDS = 15  # a second of two triggered cameras: more puts nothing right


class ProcessSettings(Section):
    """How briskly the vehicle may move: the filter's process noise and its first uncertainty."""

    acceleration_m_s2: Positive = 10.0
    angular_acceleration_rad_s2: Positive = 40.0
    manoeuvre_ms: Positive = 400.0
    initial_speed_m_s: Positive = 2.5
    initial_rate_rad_s: Positive = 1.6
    tilt_deg: Positive = 20.0
    tilt_ms: Positive = 500.0


class TrackerSettings(Section):
    """How sightings become estimates."""

    method: Literal["ekf", "paper"] = "ekf"
    coast_limit_ms: Positive = 200.0
    continuity_limit_ms: Positive = 1000.0
    tilt_limit_deg: Annotated[float, Strict(), Field(gt=0, le=180)] = 60.0
    sync_window_ms: NotNegative = 4.0
    gate_probability: Annotated[float, Strict(), Field(gt=0, lt=1)] = 0.999
    pixel_noise_px: Positive = 0.1
    clock_offset_sigma_ms: NotNegative = 20.0
    lag_rounds: Annotated[int, Strict(), Field(ge=0, le=MOST_LAG_ROUNDS)] = 0
    process: ProcessSettings = ProcessSettings()

    @model_validator(mode="after")
    def _can_look_back(self) -> Self:
        if self.lag_rounds and self.method == "paper":
            raise ValueError(
                f'lag_rounds = {self.lag_rounds} rounds: the method "paper" keeps no track that later rounds could put '
                'right; set 0, or method = "ekf"'
            )
        return self
