"""Whether an autopilot that somebody else started holds the parameters that the flight wants."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path

from tools.sitl.flight import FlightError
from tools.sitl.world import World

_ROUNDS = 3
_BOOT_TICKS = 3000
_SHOWN = 3


def hold(world: World, wanted: Mapping[str, float], file: Path) -> Iterator[None]:
    """Read each parameter wanted, one every 20 ms, and see that it is as it shall be.

    Args:
        world: its ground station asks and hears.
        wanted: names and values, as `file` tells them to ArduPilot.

    Raises:
        FlightError: no answer within 60 s of simulated time, or values that differ.
    """
    held = world.ground.parameters
    names = list(wanted)
    for _ in range(_BOOT_TICKS):
        if held:
            break
        _ask(world, names[0])
        yield
    else:
        raise FlightError("sitl: it answers no question for a parameter within 60 s; is it an ArduPilot?")
    for _ in range(_ROUNDS):
        for name in [each for each in names if each not in held]:
            _ask(world, name)
            yield
        yield from [None] * 10
    wrong = [_told(name, value, held.get(name)) for name, value in wanted.items() if _differs(value, held.get(name))]
    if wrong:
        more = f" and {len(wrong) - _SHOWN} more" if len(wrong) > _SHOWN else ""
        raise FlightError(
            f"--connect: it flies with other parameters: {', '.join(wrong[:_SHOWN])}{more}; "
            f"start it with --wipe --defaults {file.resolve()}"
        )


def _ask(world: World, name: str) -> None:
    world.ground.say("PARAM_REQUEST_READ", target_system=1, target_component=1, param_id=name, param_index=-1)


def _differs(wanted: float, held: float | None) -> bool:
    return held is None or not math.isclose(wanted, held, rel_tol=1e-5, abs_tol=1e-6)


def _told(name: str, wanted: float, held: float | None) -> str:
    return f"{name} {'missing' if held is None else format(held, 'g')} instead of {wanted:g}"
