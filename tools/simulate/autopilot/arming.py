"""Why the autopilot does not arm.

Source: ArduPilot's AP_Arming, AP_NavEKF_Source and ArduCopter's own checks as of 4.8 development: those that external
vision has to do with, in their order, in their words.
"""

from __future__ import annotations

from collections.abc import Iterator

from tools.simulate.autopilot.navigation import Navigation
from tools.simulate.autopilot.parameters import Parameters

_NONE, _EXTERNAL = 0, 6


def refusals(parameters: Parameters, navigation: Navigation, vision_healthy: bool) -> Iterator[str]:
    """Yield every reason, without the `PreArm: ` or `Arm: ` that goes before it; nothing if it may arm."""
    if parameters["GPS1_TYPE"] != _NONE:
        yield "GPS 1: Bad fix"
    if navigation.answered_origin is None:
        yield "AHRS: waiting for home"
    sources = ["POSXY", "VELXY", "POSZ", "VELZ", "YAW"]
    values = {name: parameters[f"EK3_SRC1_{name}"] for name in sources}
    if values["POSXY"] == 3 or values["VELXY"] == 3 or values["VELZ"] == 3:
        yield "AHRS: EK3 sources require GPS"
    elif values["YAW"] == 1 and parameters["COMPASS_ENABLE"] == 0:
        yield "AHRS: EK3 sources require Compass"
    elif _EXTERNAL in values.values() and parameters["VISO_TYPE"] == 0:
        yield "AHRS: EK3 sources require VisualOdom"
    elif values["POSZ"] != _EXTERNAL:
        yield "this simulated autopilot has no barometer; set EK3_SRC1_POSZ 6"
    if parameters["VISO_TYPE"] != 0 and not vision_healthy:
        yield "VisOdom: not healthy"
    if not navigation.runs:
        yield "AHRS: EKF3 not initialised"
    elif not navigation.aided:
        yield "Need Position Estimate"
