"""The helicopter that SITL flies: 55 g as ours, but without a flybar, and how its servos move the swash plate.

ArduPilot's rate loops want a vehicle whose cyclic commands a rate. A flybar commands a tilt, which no stock tuning
flies. So the righting moment is all but gone, and full swash gives the 5 rad/s that ATC_RAT_RLL_FF 0.2 stands for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from tools.simulate.helicopter import Helicopter, Sticks

VEHICLE = Helicopter(
    cyclic_moment_n_m=5.5e-3,
    tilt_stiffness_n_m=2.0e-4,
    yaw_moment_n_m=9.0e-3,
    rotor_lag_s=0.03,
    lift_lag_s=0.05,
    collective_share=1.4,
    drag_n_s_m=0.03,
    trim=(0.01, -0.01, 0.01, 0.0),
)

COLLECTIVE_PWM = (1460, 1740)
"""H_COL_MIN and H_COL_MAX, and the blade angles they stand for: H_COL_ANG_MIN and H_COL_ANG_MAX."""
COLLECTIVE_DEG = (-2.0, 12.0)
HOVER_DEG = 5.0
_SWASH = 0.45
_MOTOR_PWM = 1300


def sticks_of(pwm: Sequence[int]) -> Sticks:
    """Return what the servos tell the rotors.

    pwm: output of servos 1 to 8 [us]: swash plate at -60, 60 and 180 deg (H3-120), tail, three unused, motor.
    Source: ArduPilot mixes servo i as 0.45 cos(angle + 90) roll + 0.45 cos(angle) pitch + collective, 0..1 over
        1000..2000 us, roll positive to the right and pitch positive nose up; this is its inverse.
    """
    first, second, third = ((us - 1000) / 1000.0 for us in pwm[:3])
    roll = (first - second) / (2.0 * _SWASH * math.cos(math.radians(30.0)))
    nose_up = ((first + second) / 2.0 - third) / (1.5 * _SWASH)
    low_us, high_us = COLLECTIVE_PWM
    low_deg, high_deg = COLLECTIVE_DEG
    share = (1000.0 * (first + second + third) / 3.0 + 1000.0 - low_us) / (high_us - low_us)
    blade_deg = low_deg + share * (high_deg - low_deg)
    collective = (blade_deg / HOVER_DEG - 1.0) / VEHICLE.collective_share
    return Sticks(roll, -nose_up, -(pwm[3] - 1500) / 500.0, collective, pwm[7] > _MOTOR_PWM)
