"""Turn what pydantic found into one line that tells the operator what to mend."""

from __future__ import annotations

import difflib
import typing
from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel, ValidationError

from bridge.settings.models import Settings

# Longest first: `_rad_s2` must not be read as `_s2`.
UNITS = {
    "_rad_s2": " rad/s^2", "_m_s2": " m/s^2", "_rad_s": " rad/s", "_m_s": " m/s",
    "_deg": " deg", "_us": " us", "_g": " g", "_mm": " mm", "_ms": " ms", "_px": " px", "_hz": " Hz", "_m": " m",
}  # fmt: skip
LIMITS = {
    "greater_than": ("gt", "greater than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}
KINDS = {"model_type": "a table", "tuple_type": "a list"}
Location = tuple[int | str, ...]


def complaint(error: ValidationError, table: Mapping[str, object]) -> str:
    """Describe the first mistake in one line.

    Args:
        error: what pydantic says of `table`.
        table: the config as TOML gave it.
    Returns:
        Section, key, value with unit, limit and remedy; then how many mistakes wait behind it.
    """
    # A mistyped key is both unknown and missing: the unknown one shows the typing error.
    found = sorted(error.errors(include_url=False), key=lambda one: one["type"] != "extra_forbidden")
    more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    return _one_line(_describe(found[0], table)) + more


def _describe(found: Mapping[str, Any], table: Mapping[str, object]) -> str:
    location = found["loc"]
    if found["type"] == "extra_forbidden":
        return _unknown(location, table)
    if found["type"] == "missing":
        return f"{_section(location[:-1], table)}{location[-1]} missing; add it (see the shipped lab config)"
    if found["type"] == "value_error":
        return f"{_section(location, table)}{found['ctx']['error']}"
    key, place = _key(location)
    unit = next((unit for suffix, unit in UNITS.items() if key.endswith(suffix)), "")
    value = f"{_section(location[: place or None], table)}{key} = {found['input']!r}{unit}"
    return f"{value}: {_limit(found, unit)}"


def _limit(found: Mapping[str, Any], unit: str) -> str:
    context = found.get("ctx", {})
    if found["type"] in LIMITS:
        key, words = LIMITS[found["type"]]
        return f"must be {words} {context[key]:g}{unit}; correct it"
    if found["type"] in ("too_short", "too_long"):
        wanted = context.get("min_length") or context["max_length"]
        return f"holds {context['actual_length']} values, wanted {wanted}; correct it"
    if found["type"] in ("string_too_short", "string_too_long"):
        wanted = context.get("min_length") or context["max_length"]
        return f"has {len(found['input'])} characters, wanted {wanted}; correct it"
    if found["type"] in KINDS:
        return f"must be {KINDS[found['type']]}; correct it"
    if found["type"] == "literal_error":
        return f"must be {context['expected']}; correct it"
    said = found["msg"].replace("Input should", "must").replace("a valid integer", "a whole number")
    return f"{said.replace('a valid', 'a')}; correct it"


def _unknown(location: Location, table: Mapping[str, object]) -> str:
    known = _known_keys(location[:-1])
    near = difflib.get_close_matches(str(location[-1]), known, n=1)
    hint = f"did you mean {near[0]}? " if near else ""
    return f"{_section(location[:-1], table)}unknown key {location[-1]}; {hint}known keys: {', '.join(known)}"


def _known_keys(location: Location) -> list[str]:
    """Return the keys of the section at `location`."""
    model: type[BaseModel] = Settings
    for name in location:
        if isinstance(name, str):
            annotation = model.model_fields[name].annotation
            inner = typing.get_args(annotation)
            model = inner[0] if inner else typing.cast(type[BaseModel], annotation)
    return list(model.model_fields)


def _key(location: Location) -> tuple[str, int]:
    """Return the key a value stands under, `position_mm[2]` for an item, and where it begins, counted from the end."""
    items = 0
    while len(location) - items > 1 and isinstance(location[-1 - items], int):
        items += 1
    start = -1 - items
    return str(location[start]), start


def _section(location: Location, table: Mapping[str, object]) -> str:
    """Write a location as its header in the file: `[tracker.process] `, `[[marker.balls]] green: `."""
    names: list[str] = []
    item = ""
    value: object = table
    for step in location:
        value = _step(value, step)
        if isinstance(step, str):
            names.append(step)
        else:
            name = value.get("name", value.get("uri")) if isinstance(value, Mapping) else None
            item = f" {name or f'number {step + 1}'}:"
    if not names:
        return ""
    header = ".".join(names)
    return f"[[{header}]]{item} " if item else f"[{header}] "


def _step(value: object, step: int | str) -> object:
    if isinstance(value, Mapping):
        return value.get(step)
    if isinstance(value, Sequence) and isinstance(step, int) and step < len(value):
        return value[step]
    return None


def _one_line(text: str) -> str:
    return " ".join(text.split())
