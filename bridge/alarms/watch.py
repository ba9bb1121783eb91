"""Alarms over time: raised once a bad reading has lasted, over once good ones have."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from bridge.alarms.readings import Readings
from bridge.alarms.rule import Finding, Level, Rule, Verdict
from bridge.alarms.rules import GAP_RULE, GAP_SEVERE_RULE, RULES

SHADOWED = {GAP_RULE.name: GAP_SEVERE_RULE.name}


@dataclass(frozen=True, slots=True)
class Alarm:
    """One alarm that stands.

    name: of its rule.  subject: the camera, ball or link it is about, "" for the run.
    since_s: for how long it has stood [s].
    """

    name: str
    subject: str
    level: Level
    cause: str
    remedy: str
    since_s: float


@dataclass(frozen=True, slots=True)
class Watch:
    """One rule on one subject.

    raised_ns: since when it has stood, None while it does not.  turning_ns: since when the readings have said
    otherwise, None while they agree.
    """

    raised_ns: int | None = None
    turning_ns: int | None = None
    cause: str = ""
    remedy: str = ""


Standing = Mapping[tuple[str, str], Watch]
"""Every rule and subject that is not at rest."""

NOTHING: Standing = MappingProxyType({})
_BY_NAME = {rule.name: rule for rule in RULES}
_CALM = Watch()
_WELL = Finding("", Verdict.GOOD, "", "")  # of a subject that its rule does not mention


def advance(standing: Standing, now: Readings) -> Standing:
    """Judge new readings and return how the alarms stand after them."""
    found = {(rule.name, finding.subject): finding for rule in RULES for finding in rule.judge(now)}
    watches: dict[tuple[str, str], Watch] = {}
    for key in dict.fromkeys((*found, *standing)):
        watch = _after(standing.get(key, _CALM), found.get(key, _WELL), _BY_NAME[key[0]], now.t_ns)
        if watch is not _CALM:
            watches[key] = watch
    return watches


def standing_alarms(standing: Standing, t_ns: int) -> tuple[Alarm, ...]:
    """Return the alarms that stand at stream time t_ns [ns], those that matter most first, one of a kind."""
    alarms = [
        Alarm(rule.name, subject, rule.level, watch.cause, watch.remedy, (t_ns - watch.raised_ns) / 1e9)
        for rule in RULES
        for (name, subject), watch in standing.items()
        if name == rule.name and watch.raised_ns is not None
    ]
    names = {alarm.name for alarm in alarms}
    shown = [alarm for alarm in alarms if SHADOWED.get(alarm.name) not in names]
    return tuple(sorted(shown, key=lambda alarm: alarm.level is not Level.ALARM))


def _after(watch: Watch, finding: Finding, rule: Rule, t_ns: int) -> Watch:
    """Return a watch after one more finding; `_CALM` when there is nothing to remember."""
    raised = watch.raised_ns is not None
    if finding.verdict is not (Verdict.GOOD if raised else Verdict.BAD):
        return Watch(watch.raised_ns, None, finding.cause, finding.remedy) if raised else _CALM
    turning_ns = t_ns if watch.turning_ns is None else watch.turning_ns
    if t_ns - turning_ns < (rule.clear_s if raised else rule.raise_s) * 1e9:
        return replace(watch, turning_ns=turning_ns)
    return _CALM if raised else Watch(t_ns, None, finding.cause, finding.remedy)
