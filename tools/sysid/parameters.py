"""The hover model's parameters: only groups that a flight shows, such as moments over inertias."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from tracker.types import Array


class Axis(StrEnum):
    """One control of a helicopter, as a stick: about B's axes +roll is right, +pitch nose down, +yaw nose left."""

    ROLL = "roll"
    PITCH = "pitch"
    YAW = "yaw"
    HEAVE = "heave"


AXES = tuple(Axis)


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter: what it is, where the fit may look for it, and how large a change is worth noticing.

    symbol: as in docs/sysid.md.  per: what it is made of in the vehicle's own values.
    """

    name: str
    symbol: str
    unit: str
    per: str
    least: float
    most: float
    scale: float


_BIG = 1e3
PARAMETERS = (
    Parameter("roll_gain", "L_u", "rad/s^2 per full stick", "cyclic moment / I_xx", 0.1, _BIG, 10.0),
    Parameter("roll_stiffness", "L_phi", "1/s^2", "tilt stiffness / I_xx", 0.0, _BIG, 30.0),
    Parameter("roll_damping", "L_p", "1/s", "tilt damping / I_xx", 0.1, _BIG, 5.0),
    Parameter("pitch_gain", "M_u", "rad/s^2 per full stick", "cyclic moment / I_yy", 0.1, _BIG, 10.0),
    Parameter("pitch_stiffness", "M_theta", "1/s^2", "tilt stiffness / I_yy", 0.0, _BIG, 30.0),
    Parameter("pitch_damping", "M_q", "1/s", "tilt damping / I_yy", 0.1, _BIG, 5.0),
    Parameter("rotor_lag", "tau_r", "s", "rotor and stabiliser after the swash plate", 0.005, 1.0, 0.03),
    Parameter("yaw_gain", "N_u", "rad/s^2 per full stick", "yaw moment / I_zz", 0.1, _BIG, 5.0),
    Parameter("yaw_damping", "N_r", "1/s", "yaw damping / I_zz", 0.05, _BIG, 3.0),
    Parameter("heave_gain", "Z_u", "m/s^2 per full stick", "change of lift / mass", 0.1, _BIG, 3.0),
    Parameter("heave_damping", "Z_w", "1/s", "loss of lift per climb rate / mass", 0.0, _BIG, 1.0),
    Parameter("lift_lag", "tau_l", "s", "lift after the collective", 0.005, 1.0, 0.03),
    Parameter("drag", "X_v", "1/s", "drag per speed across the rotor's axis / mass", 0.0, _BIG, 1.0),
    Parameter("delay", "tau_d", "s", "from the servo's order until the rotor obeys", -0.05, 0.3, 0.02),
    Parameter("roll_trim", "u_0,roll", "of full stick", "always there", -1.0, 1.0, 0.1),
    Parameter("pitch_trim", "u_0,pitch", "of full stick", "always there", -1.0, 1.0, 0.1),
    Parameter("yaw_trim", "u_0,yaw", "of full stick", "always there", -1.0, 1.0, 0.1),
    Parameter("heave_trim", "u_0,heave", "of full stick", "always there", -1.0, 1.0, 0.1),
    Parameter("roll_level", "b_x", "rad", "marker against rotor disc, about x", -0.3, 0.3, 0.03),
    Parameter("pitch_level", "b_y", "rad", "marker against rotor disc, about y", -0.3, 0.3, 0.03),
)
NAMES = tuple(parameter.name for parameter in PARAMETERS)
COUNT = len(PARAMETERS)
LEAST, MOST, SCALE = (
    np.array([getattr(parameter, field) for parameter in PARAMETERS]) for field in ("least", "most", "scale")
)
INDEX = {name: k for k, name in enumerate(NAMES)}


def vector(**values: float) -> Array:
    """Return the parameters as an array (20,); those left out are zero.

    Raises:
        KeyError: a name that is none.
    """
    theta = np.zeros(COUNT)
    for name, value in values.items():
        theta[INDEX[name]] = value
    return theta
