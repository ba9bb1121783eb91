"""One `posebridge calibrate refine`: a flight's log in; what moved, how well it is mended, and the cameras out."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridge.log.calibration import CALIBRATION_ATTACHMENT, cameras_of
from bridge.log.reader import LogReader
from bridge.settings.choose_rig import marker_of
from tools.calibrate.formats.own import write_own
from tools.calibrate.refine.evidence import Evidence, Instant, read_evidence
from tools.calibrate.refine.judge import Judged, judge
from tools.calibrate.refine.report import to_json, to_text
from tools.calibrate.refine.solve import refine
from tools.colours.write import check_target
from tools.replay import settings_of
from tracker.errors import OperatorError
from tracker.rig import Rig, make_rig

STRETCH_NS = 2_000_000_000
HELD_OUT = 5  # of every five stretches the last is held out, to judge by
LEAST = 60  # instants


@dataclass(frozen=True, slots=True)
class RefineRequest:
    """log: the flight's.  moved: names of the cameras that moved; empty for those that the flight itself named.

    out: where the cameras go, None for nowhere.
    """

    log: Path
    moved: tuple[str, ...]
    out: Path | None
    overwrite: bool
    as_json: bool


def run_refine(request: RefineRequest) -> Judged:
    """Read, solve, judge, show and write.

    Raises:
        OperatorError: no log of ours, nothing in it that moved, or too little seen since.
    """
    if request.out is not None:
        check_target(request.out, "--out", request.overwrite)
    reader = LogReader(request.log)
    rig = _rig(reader, request.log)
    evidence = read_evidence(reader, rig)
    bumped = _bumped(request, evidence, rig)
    since_ns = max((evidence.told_ns[c] for c in bumped if c in evidence.told_ns), default=-(2**63))
    fitting, held_out = _split(evidence.since(since_ns))
    if len(fitting) < LEAST:
        raise OperatorError(
            f"log {request.log}: {len(fitting)} instants in which two cameras saw the marker since the bump; at least "
            f"{LEAST} are needed: fly, or carry the vehicle through the room, for a minute with a log"
        )
    refined = refine(fitting, rig, bumped)
    judged = judge(rig, refined, bumped, held_out)
    if request.out is not None:
        write_own(refined.cameras, request.out, tuple(_remarks(request, judged)))
    sys.stdout.write((to_json(judged) if request.as_json else to_text(judged)) + "\n")
    return judged


def _rig(reader: LogReader, path: Path) -> Rig:
    attached = reader.attachments().get(CALIBRATION_ATTACHMENT)
    if attached is None:
        raise OperatorError(f"log {path}: holds no calibration; its front is damaged, and nothing can be made of it")
    return make_rig(cameras_of(attached, f"log {path}"), marker_of(settings_of(path).marker))


def _bumped(request: RefineRequest, evidence: Evidence, rig: Rig) -> tuple[int, ...]:
    """Return the cameras to mend: those named, else those that the flight named."""
    names = [camera.name for camera in rig.cameras]
    for name in request.moved:
        if name not in names:
            raise OperatorError(f"--moved {name}: no such camera; the log has {', '.join(names)}")
    bumped = tuple(sorted({names.index(name) for name in request.moved} or evidence.told_ns))
    if not bumped:
        raise OperatorError(f"log {request.log}: no camera moved in that flight; name one with --moved if you know")
    if len(bumped) == len(names):
        raise OperatorError(
            f"{', '.join(names)}: all have moved, and none is left to hold the room; calibrate the room anew"
        )
    return bumped


def _split(instants: tuple[Instant, ...]) -> tuple[list[Instant], list[Instant]]:
    """Return the instants to fit, and whole stretches that are held out."""
    if not instants:
        return [], []
    first_ns = instants[0].state.t_ns
    turns = np.array([(one.state.t_ns - first_ns) // STRETCH_NS % HELD_OUT for one in instants])
    chosen = turns == HELD_OUT - 1
    return [instants[k] for k in np.flatnonzero(~chosen)], [instants[k] for k in np.flatnonzero(chosen)]


def _remarks(request: RefineRequest, judged: Judged) -> Iterator[str]:
    names = ", ".join(move.name for move in judged.moves)
    yield f"Written by `posebridge calibrate refine {request.log.name}`: {names} mended; the others as they were."
    yield f"Verdict: {judged.grade}. {judged.reason}"
