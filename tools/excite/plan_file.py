"""A plan as files: TOML to read and edit, CSV of the sticks over time for other players."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated

import tomlkit
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from tools.excite.manoeuvre import Kind, Manoeuvre, Sequence
from tools.excite.plan import Plan
from tools.sysid.parameters import Axis
from tracker.errors import OperatorError

CSV_HZ = 50
_HEAD = """A plan of `posebridge excite`: what is added to the sticks, and when. `posebridge demo --excite` flies it.
Times in s after the beginning, amplitudes as shares of full stick, bands in Hz. The excursion is what the vehicle does
at most with nothing against it, half of the way from end to end: in mm, for yaw in deg."""


class _Entry(BaseModel):
    """One manoeuvre as the file holds it."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    axis: Axis
    kind: Kind
    start_s: Annotated[float, Field(ge=0)]
    duration_s: Annotated[float, Field(gt=0, le=600)]
    amplitude: Annotated[float, Field(gt=0, le=1)]
    low_hz: Annotated[float, Field(gt=0, le=50)]
    high_hz: Annotated[float, Field(gt=0, le=50)]
    excursion: float | None = None
    excursion_unit: str | None = None


class _File(BaseModel):
    """A whole plan."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    manoeuvres: Annotated[tuple[_Entry, ...], Field(min_length=1)]


def write_plan(plan: Plan, path: Path) -> None:
    """Write a plan as TOML, and its sticks as CSV beside it.

    Raises:
        OperatorError: a path that cannot be written.
    """
    document = tomlkit.document()
    for line in _HEAD.splitlines():
        document.add(tomlkit.comment(line))
    entries = tomlkit.aot()
    for each in plan.planned:
        move = each.manoeuvre
        table = tomlkit.table()
        for name in ("start_s", "duration_s", "amplitude", "low_hz", "high_hz"):
            table[name] = round(getattr(move, name), 4)
        table["axis"], table["kind"] = move.axis.value, move.kind.value
        table["excursion"], table["excursion_unit"] = round(each.shown, 1), each.unit
        entries.append(table)
    document["manoeuvres"] = entries
    try:
        path.write_text(tomlkit.dumps(document), encoding="utf-8")
        path.with_suffix(".csv").write_text(_csv(plan.sequence), encoding="ascii")
    except OSError as error:
        raise OperatorError(f"--out {path}: cannot be written ({error.strerror}); name another file") from error


def read_plan(path: Path) -> Sequence:
    """Read a plan's manoeuvres.

    Raises:
        OperatorError: no such file, no TOML, or what no manoeuvre can be.
    """
    try:
        file = _File.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except OSError as error:
        raise OperatorError(
            f"plan {path}: cannot be read ({error.strerror}); `posebridge excite --out {path}` makes one"
        ) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise OperatorError(f"plan {path}: not TOML: {error}; make it anew with `posebridge excite`") from error
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(map(str, first["loc"]))
        raise OperatorError(
            f"plan {path}: {place}: {first['msg']}; correct it, or `posebridge excite` makes a plan"
        ) from error
    moves = (entry.model_dump(exclude={"excursion", "excursion_unit"}) for entry in file.manoeuvres)
    return Sequence(tuple(Manoeuvre(**move) for move in moves))


def _csv(sequence: Sequence) -> str:
    lines = ["t_s,roll_right,nose_up,nose_right,up"]
    for k in range(round(sequence.duration_s * CSV_HZ) + 1):
        roll, pitch, yaw, heave = sequence.sticks_at(k / CSV_HZ)
        lines.append(f"{k / CSV_HZ:.3f},{roll:.5f},{0.0 - pitch:.5f},{0.0 - yaw:.5f},{heave:.5f}")
    return "\n".join(lines) + "\n"
