"""What a parameter must be, and the line that says whether it is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from bridge.preflight.parameters import Parameter
from bridge.preflight.verdict import Line, Mark, Write

Accepts = Callable[[float], bool]


@dataclass(frozen=True, slots=True)
class Rule:
    """What one parameter must be.

    names: its name, before it those of newer firmware.  value: what --apply sets.
    accepts: says whether a value will do.  needed: the same in words, with the reason.
    reboot: it counts only after a reboot.  doubt: wrong, it flies all the same, only worse.
    optional: firmware without it is right as it is.
    """

    names: tuple[str, ...]
    value: float
    accepts: Accepts
    needed: str
    reboot: bool = False
    doubt: bool = False
    optional: bool = False


def exactly(value: float) -> Accepts:
    """Accept one value alone."""
    return lambda held: abs(held - value) < 1e-6


def within(least: float, most: float) -> Accepts:
    """Accept a range, its ends included."""
    return lambda held: least - 1e-6 <= held <= most + 1e-6


def with_bits(mask: int) -> Accepts:
    """Accept whatever has all these bits."""
    return lambda held: int(held) & mask == mask


def names_of(rules: Iterable[Rule]) -> tuple[str, ...]:
    """Return every name to ask for."""
    return tuple(name for rule in rules for name in rule.names)


def judge(rules: Sequence[Rule], known: Mapping[str, Parameter]) -> tuple[Line, ...]:
    """Return a line for each rule; those without a parameter in this firmware only where one is needed."""
    if rules and not known:
        fix = "it answers no question: the link goes one way only, is too poor, or leads to another autopilot"
        return (Line(Mark.UNKNOWN, "all of them", "none told", "told", fix),)
    lines = (_line(rule, known) for rule in rules)
    return tuple(line for line in lines if line is not None)


def figure(value: float) -> str:
    """Return a parameter's value as people write it: 32-bit floats do not show their rounding."""
    return f"{value:.6g}"


def set_to(name: str, value: float, reboot: bool) -> str:
    """Say how to mend a parameter."""
    return f"set {name} {figure(value)}" + (" and reboot the autopilot" if reboot else "") + " (--apply does)"


def _line(rule: Rule, known: Mapping[str, Parameter]) -> Line | None:
    name = next((name for name in rule.names if name in known), None)
    if name is None:
        if rule.optional:
            return None
        fix = f"it never answered for {' or '.join(rule.names)}: see the firmware's line, or the link is too poor"
        return Line(Mark.UNKNOWN, rule.names[0], "not told", rule.needed, fix)
    held = known[name].value
    if rule.accepts(held):
        return Line(Mark.PASS, name, figure(held), rule.needed)
    mark = Mark.WARN if rule.doubt else Mark.FAIL
    write = Write(name, rule.value, rule.reboot)
    return Line(mark, name, figure(held), rule.needed, set_to(name, rule.value, rule.reboot), write)
