"""The autopilot's parameters: those that matter to external vision, by ArduPilot's names and defaults."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

REAL32, INT8, INT16, INT32 = 9, 2, 4, 6
"""MAV_PARAM_TYPE of a float and of the signed integers."""

_DEFAULTS: dict[str, tuple[float, int]] = {
    "ARMING_CHECK": (1, INT32),
    "AHRS_EKF_TYPE": (3, INT8),
    "COMPASS_ENABLE": (1, INT8),
    "EK3_ENABLE": (1, INT8),
    "EK3_OGN_HGT_MASK": (0, INT8),
    "EK3_SRC1_POSXY": (3, INT8),
    "EK3_SRC1_VELXY": (3, INT8),
    "EK3_SRC1_POSZ": (1, INT8),
    "EK3_SRC1_VELZ": (3, INT8),
    "EK3_SRC1_YAW": (1, INT8),
    "FENCE_ENABLE": (0, INT8),
    "FRAME_CLASS": (6, INT8),
    "FS_EKF_ACTION": (1, INT8),
    "FS_EKF_THRESH": (0.8, REAL32),
    "GPS1_TYPE": (1, INT8),
    "MAV_SYSID": (1, INT16),
    "SERIAL1_BAUD": (57, INT32),
    "SERIAL1_PROTOCOL": (2, INT8),
    "VISO_DELAY_MS": (10, INT16),
    "VISO_POS_M_NSE": (0.2, REAL32),
    "VISO_QUAL_MIN": (0, INT8),
    "VISO_TYPE": (0, INT8),
    "VISO_VEL_M_NSE": (0.1, REAL32),
    "VISO_YAW_M_NSE": (0.2, REAL32),
    "WP_YAW_BEHAVIOR": (2, INT8),
}
FOR_VISION: Mapping[str, float] = {
    "COMPASS_ENABLE": 0,
    "EK3_OGN_HGT_MASK": 4,
    "EK3_SRC1_POSXY": 6,
    "EK3_SRC1_VELXY": 6,
    "EK3_SRC1_POSZ": 6,
    "EK3_SRC1_VELZ": 6,
    "EK3_SRC1_YAW": 6,
    "FENCE_ENABLE": 1,
    "GPS1_TYPE": 0,
    "VISO_POS_M_NSE": 0.1,
    "VISO_TYPE": 1,
    "VISO_YAW_M_NSE": 0.1,
    "WP_YAW_BEHAVIOR": 0,
}
"""What an operator sets for flight on vision with velocity, beside VISO_DELAY_MS."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter as PARAM_VALUE tells it. kind: MAV_PARAM_TYPE.  index: its place among `count`."""

    name: str
    value: float
    kind: int
    index: int
    count: int


class Parameters:
    """The table. Names not known are refused, integers are rounded, all as the real autopilot does."""

    def __init__(self, values: Mapping[str, float]) -> None:
        """Start with ArduPilot's defaults and the given values.

        Raises:
            KeyError: a name this autopilot does not have.
        """
        self._values = {name: value for name, (value, _) in _DEFAULTS.items()}
        self._names = tuple(_DEFAULTS)
        for name, value in values.items():
            if self.set(name, value) is None:
                raise KeyError(name)

    def __getitem__(self, name: str) -> float:
        """Return a value."""
        return self._values[name]

    def __iter__(self) -> Iterator[Parameter]:
        """Yield every parameter."""
        return (self._parameter(name) for name in self._names)

    def get(self, name: str, index: int = -1) -> Parameter | None:
        """Return a parameter by index, or by name where the index is negative; None if there is none."""
        if index >= 0:
            return self._parameter(self._names[index]) if index < len(self._names) else None
        return self._parameter(name) if name in self._values else None

    def set(self, name: str, value: float) -> Parameter | None:
        """Set a value and return what is now held; None for a name not known."""
        if name not in self._values:
            return None
        self._values[name] = value if _DEFAULTS[name][1] == REAL32 else float(round(value))
        return self._parameter(name)

    def _parameter(self, name: str) -> Parameter:
        return Parameter(name, self._values[name], _DEFAULTS[name][1], self._names.index(name), len(self._names))
