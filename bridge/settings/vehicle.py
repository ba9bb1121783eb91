"""The vehicle's sheet: what system identification must know of it beforehand."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, Strict, model_validator

from bridge.settings.section import Name, Positive, Real, Section, Triple, refuse_twins


class ServoSettings(Section):
    """One servo: its pulse at rest, and how much full stick of each kind adds to it."""

    channel: Annotated[int, Strict(), Field(ge=1, le=16)]
    trim_us: Positive
    right_us: Real = 0.0
    nose_up_us: Real = 0.0
    nose_right_us: Real = 0.0
    up_us: Real = 0.0


class VehicleSettings(Section):
    """The vehicle's sheet: mass and geometry, what full sticks give, and which servo does what."""

    name: Name
    mass_g: Positive
    rotor: Literal["flybar", "coaxial", "other"]
    rotor_diameter_mm: Positive
    centre_of_mass_mm: Triple = (0.0, 0.0, 0.0)
    max_tilt_deg: Annotated[float, Strict(), Field(gt=0, lt=90)] = 20.0
    max_speed_m_s: Positive = 1.5
    full_tilt_deg: Annotated[float, Strict(), Field(gt=0, lt=90)]
    full_yaw_rate_deg_s: Positive
    full_climb_m_s2: Positive
    servos: tuple[ServoSettings, ...] = ()

    @model_validator(mode="after")
    def _channels_differ(self) -> Self:
        refuse_twins("servo channel", [str(servo.channel) for servo in self.servos])
        return self
