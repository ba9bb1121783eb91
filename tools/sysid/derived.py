"""What follows from the hover model's parameters: figures a pilot or a designer knows."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bridge.settings.vehicle import VehicleSettings
from tools.simulate.dynamics import GRAVITY
from tools.sysid.parameters import INDEX
from tracker.types import Array


@dataclass(frozen=True, slots=True)
class Derived:
    """One figure. source: how it follows."""

    name: str
    value: float
    unit: str
    source: str


def derived_of(theta: Array, vehicle: VehicleSettings) -> tuple[Derived, ...]:
    """Return the figures; those in newtons take the sheet's mass."""

    def of(name: str) -> float:
        return float(theta[INDEX[name]])

    mass_kg = vehicle.mass_g * 1e-3
    figures = []
    for axis, control, stiff, damp in (("roll", "L_u", "L_phi", "L_p"), ("pitch", "M_u", "M_theta", "M_q")):
        stiffness = max(of(f"{axis}_stiffness"), 1e-9)
        natural = math.sqrt(stiffness)
        tilt_deg = math.degrees(math.asin(max(-1.0, min(1.0, of(f"{axis}_gain") / stiffness))))
        figures += [
            Derived(f"steady {axis} at full stick", tilt_deg, "deg", f"asin({control} / {stiff})"),
            Derived(f"{axis} natural frequency", natural / (2.0 * math.pi), "Hz", f"sqrt({stiff}) / 2 pi"),
            Derived(f"{axis} damping ratio", of(f"{axis}_damping") / (2.0 * natural), "", f"{damp} / 2 sqrt({stiff})"),
        ]  # fmt: skip
    yaw = math.degrees(of("yaw_gain") / max(of("yaw_damping"), 1e-9))
    climb = of("heave_gain") / max(of("heave_damping"), 1e-9)
    return (
        *figures,
        Derived("steady yaw rate at full stick", yaw, "deg/s", "N_u / N_r"),
        Derived("steady climb at full stick", climb, "m/s", "Z_u / Z_w"),
        Derived("speed lost to drag after", 1.0 / max(of("drag"), 1e-9), "s", "1 / X_v, to 37 %"),
        Derived("drag", of("drag") * mass_kg, "N s/m", "X_v m"),
        Derived("heave damping", of("heave_damping") * mass_kg, "N s/m", "Z_w m"),
        Derived("lift at full stick", of("heave_gain") / GRAVITY, "of the weight", "Z_u / g"),
    )
