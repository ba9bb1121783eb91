"""Find a config, read it and check it."""

from __future__ import annotations

import tomllib
from pathlib import Path

from pydantic import ValidationError

import config
from bridge.settings.complaint import complaint
from bridge.settings.models import Settings
from tracker.errors import OperatorError

SUFFIX = ".toml"


def load_settings(name_or_path: str | Path) -> Settings:
    """Load a shipped config by its name, or any config by its path.

    Args:
        name_or_path: the name of a shipped config, such as `lab`; anything else is a path.
    Returns:
        The settings; paths in it, if given, made absolute from the config's own folder.
    Raises:
        OperatorError: no such file, no TOML, an unknown key, a value outside its limit.
    """
    path = config_path(name_or_path)
    table = _read(path)
    _anchor(table, "rig", "calibration", path.resolve().parent)
    _anchor(table, "mavlink", "signing_key", path.resolve().parent)
    try:
        return Settings.model_validate(table)
    except ValidationError as error:
        raise OperatorError(f"config {path}: {complaint(error, table)}") from error


def config_path(name_or_path: str | Path) -> Path:
    """Return the file of a config: a shipped one's by its name, else the path itself."""
    return shipped_configs().get(str(name_or_path), Path(name_or_path))


def shipped_configs() -> dict[str, Path]:
    """Return the configs that come with the package, by name."""
    folder = Path(config.__file__).parent
    return {path.stem: path for path in sorted(folder.glob(f"*{SUFFIX}"))}


def _read(path: Path) -> dict[str, object]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise OperatorError(f"config {path}: not TOML: {error}; correct that line") from error
    except UnicodeDecodeError as error:
        raise OperatorError(f"config {path}: not UTF-8 text at byte {error.start}; save it as UTF-8") from error
    except OSError as error:
        shipped = ", ".join(shipped_configs())
        raise OperatorError(
            f"config {path}: cannot be read ({error.strerror}); shipped configs: {shipped}; or give a path to a .toml"
        ) from error


def _anchor(table: dict[str, object], section: str, key: str, folder: Path) -> None:
    """Make a relative path start at the config's folder, so the config can be used from anywhere."""
    chosen = table.get(section)
    if isinstance(chosen, dict) and isinstance(chosen.get(key), str) and chosen[key]:
        chosen[key] = str(folder / Path(chosen[key]).expanduser())
