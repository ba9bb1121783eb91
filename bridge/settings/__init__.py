"""The operator's choices: a TOML file, checked, as frozen values."""

from bridge.settings.choose_rig import ChosenRig, RigOrigin, marker_of, rig_of
from bridge.settings.load import config_path, load_settings, shipped_configs
from bridge.settings.models import LinkSettings, MonitorSettings, PlaceSettings, Settings
from bridge.settings.tracking import TrackerSettings

__all__ = [
    "ChosenRig",
    "LinkSettings",
    "MonitorSettings",
    "PlaceSettings",
    "RigOrigin",
    "Settings",
    "TrackerSettings",
    "config_path",
    "load_settings",
    "marker_of",
    "rig_of",
    "shipped_configs",
]
