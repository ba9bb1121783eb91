"""What a log says of a run, as arrays."""

from __future__ import annotations

import base64
import hashlib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bridge.log import topics
from bridge.log.losses import Loss
from bridge.log.reader import LogReader
from tools.export.resample import LONG_PERIODS, Layout, Spacing, Times, interpolated
from tracker.errors import OperatorError
from tracker.sources.groundtruth import GroundTruth
from tracker.types import Array

GAP_PERIODS = 3.0
_POSE = Layout(quaternion=3)


@dataclass(frozen=True, slots=True, eq=False)
class Path7:
    """A path through the room. t_ns: (n,) increasing.  poses: (n, 7) p_BinW [m] and q_BtoW, w x y z.

    joined: (n,) False where it jumped.
    """

    t_ns: Times
    poses: Array
    joined: np.ndarray[Any, np.dtype[np.bool_]]

    def at(self, t_ns: Times) -> Array:
        """Return the poses (m, 7) at other times, NaN outside, in gaps of more than three samples and across jumps."""
        period_ns = float(np.median(np.diff(self.t_ns))) if len(self.t_ns) > 1 else 1e9
        spacing = Spacing(period_ns, round(GAP_PERIODS * period_ns), period_ns / LONG_PERIODS)
        return interpolated(self.t_ns, self.poses, self.joined, t_ns, _POSE, spacing).values


@dataclass(frozen=True, slots=True, eq=False)
class Flown:
    """One run. nis, nis_dof: (n,) of each estimate.  latency_ms: of the estimates that went out.

    rejected: counts by reason.  sent: messages by name.  wire: a hash of every frame sent, in order; "" for none.
    """

    name: str
    path: Path7
    nis: Array
    nis_dof: Array
    latency_ms: Array
    resets: int
    rejected: Counter[str]
    sent: Counter[str]
    wire: str
    lost: tuple[Loss, ...]


class _Wanted:
    def __contains__(self, topic: object) -> bool:
        return topic in _TOPICS or (isinstance(topic, str) and topic.startswith(topics.SENT_PREFIX))


def read_flown(log: Path) -> Flown:
    """Read a run's log.

    Raises:
        OperatorError: no readable log, or no estimate in it.
    """
    reader = LogReader(log)
    estimates: list[dict[str, Any]] = []
    latency_ms: list[float] = []
    rejected: Counter[str] = Counter()
    sent: Counter[str] = Counter()
    wire = hashlib.sha256()
    for record in reader.records(_Wanted()):
        value = record.value
        if record.topic == topics.ESTIMATE.name:
            estimates.append(_kept(value))
        elif record.topic == topics.LATENCY.name:
            latency_ms += [max(link["latency_ns"] for link in value["links"]) / 1e6] if value["links"] else []
        elif record.topic == topics.REJECTIONS.name:
            rejected.update(one["reason"] for one in value["rejections"])
        else:
            sent[record.topic.removeprefix(topics.SENT_PREFIX)] += 1
            wire.update(base64.b64decode(value["raw"]))
    if not estimates:
        raise OperatorError(f"log {log}: holds no estimate to compare; name a log in which the vehicle was seen")
    return _flown(log, estimates, latency_ms, rejected, sent, wire.hexdigest() if sent else "", reader.lost)


def path_of(truth: GroundTruth) -> Path7:
    """Return a recording's reference path."""
    q = Rotation.from_matrix(truth.R_BtoW).as_quat(scalar_first=True)
    return Path7(truth.t_ns, np.hstack([truth.p_BinW, q]), np.ones(len(truth), dtype=np.bool_))


_TOPICS = frozenset({topics.ESTIMATE.name, topics.LATENCY.name, topics.REJECTIONS.name})
_KEPT = ("t_ns", "p_BinW_m", "q_BtoW", "nis", "nis_dof", "reset_counter")


def _kept(value: dict[str, Any]) -> dict[str, Any]:
    return {name: value[name] for name in _KEPT}


def _flown(log: Path, estimates: list[dict[str, Any]], latency_ms: list[float], *rest: Any) -> Flown:
    estimates.sort(key=lambda one: int(one["t_ns"]))
    t_ns = np.array([one["t_ns"] for one in estimates], dtype=np.int64)
    poses = np.array([[*one["p_BinW_m"], *one["q_BtoW"]] for one in estimates], dtype=np.float64)
    counters = np.array([one["reset_counter"] for one in estimates])
    first = np.concatenate(([True], np.diff(t_ns) > 0))
    joined = np.concatenate(([True], np.diff(counters) == 0))
    nis = np.array([one["nis"] for one in estimates], dtype=np.float64)
    dof = np.array([one["nis_dof"] for one in estimates], dtype=np.float64)
    return Flown(
        log.stem, Path7(t_ns[first], poses[first], joined[first]), nis[first], dof[first], np.array(latency_ms),
        int(np.count_nonzero(~joined)), *rest,
    )  # fmt: skip
