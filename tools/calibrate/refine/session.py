"""One `posebridge calibrate refine`: a flight's log in; what moved, how well it is mended, and the room file out."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridge.log.calibration import CALIBRATION_ATTACHMENT, cameras_of
from bridge.log.reader import LogReader
from bridge.settings import Settings, load_settings, rig_of
from tools.calibrate.refine.equations import Unknowns
from tools.calibrate.refine.evidence import Evidence, Instant, read_evidence
from tools.calibrate.refine.file import config_text, held_to, record_of, with_the_others
from tools.calibrate.refine.judge import Judged, judge
from tools.calibrate.refine.report import to_json, to_text
from tools.calibrate.refine.solve import refine
from tools.calibrate.room.file import read_config, write_room
from tools.colours.write import check_target
from tools.replay import settings_of
from tools.request import Clocks
from tracker.errors import OperatorError
from tracker.rig import Rig

STRETCH_NS = 2_000_000_000
HELD_OUT = 5  # of every five stretches the last is held out, to judge by
LEAST = 60  # instants


@dataclass(frozen=True, slots=True)
class RefineRequest:
    """log: the flight's.  moved: names of the cameras that moved; empty for those that the flight itself named.

    config: that the room file is to be a copy of; None for the one in the log, which has no comments.
    by: who measured.  out: the room file, None for none.
    """

    log: Path
    moved: tuple[str, ...]
    config: str | None
    by: str
    out: Path | None
    overwrite: bool
    as_json: bool


def run_refine(request: RefineRequest, clocks: Clocks) -> Judged:
    """Read, solve, judge, show and write.

    Raises:
        OperatorError: no log of ours, nothing in it that moved, too little seen since, or another rig's config.
    """
    if request.out is not None:
        check_target(request.out, "--out", request.overwrite)
    reader, flown = LogReader(request.log), settings_of(request.log)
    settings = flown if request.config is None else load_settings(request.config)
    rig = _rig(reader, flown, request.log)
    _check_names(settings, rig, request)
    evidence = read_evidence(reader, rig)
    bumped = _bumped(request, evidence, rig)
    since_ns = max((evidence.told_ns[c] for c in bumped if c in evidence.told_ns), default=-(2**63))
    fitting, held_out = _split(evidence.since(since_ns))
    if len(fitting) < LEAST:
        raise OperatorError(
            f"log {request.log}: {len(fitting)} instants in which two cameras saw the marker since the bump; at least "
            f"{LEAST} are needed: fly, or carry the vehicle through the room, for a minute with a log"
        )
    unknowns = Unknowns(len(rig.cameras), bumped, 1e-3 * flown.tracker.clock_offset_sigma_ms)
    refined = refine(fitting, rig, unknowns, held_to(settings.rig, rig, bumped))
    judged = judge(rig, refined, held_out)
    if request.out is not None:
        text = config_text(flown) if request.config is None else read_config(request.config)
        worth = with_the_others(judged.worth, settings.rig)
        write_room(request.out, text, refined.cameras, worth, record_of(request.log, request.by, settings.rig, clocks))
    sys.stdout.write((to_json(judged) if request.as_json else to_text(judged)) + "\n")
    return judged


def _rig(reader: LogReader, flown: Settings, path: Path) -> Rig:
    """Return the rig that was flown, with what its config knew of the cameras' clocks."""
    attached = reader.attachments().get(CALIBRATION_ATTACHMENT)
    if attached is None:
        raise OperatorError(f"log {path}: holds no calibration; its front is damaged, and nothing can be made of it")
    cameras = cameras_of(attached, f"log {path}")
    unmeasured = flown.model_copy(update={"rig": flown.rig.model_copy(update={"measured": None})})
    return rig_of(unmeasured, cameras).rig


def _check_names(settings: Settings, rig: Rig, request: RefineRequest) -> None:
    """Refuse a config of another rig's cameras."""
    known, wanted = [camera.name for camera in settings.rig.cameras], [camera.name for camera in rig.cameras]
    if request.config is not None and known and not settings.rig.calibration and known != wanted:
        raise OperatorError(
            f"config {request.config}: its cameras are {', '.join(known)}, the log's {', '.join(wanted)}; name the "
            "config that was flown with"
        )


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
