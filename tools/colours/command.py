"""One `posebridge colours`: footage in; page, picture and config out."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from bridge.settings import ChosenRig, Settings, config_path, load_settings
from bridge.settings.tuning import tuning_of
from tools.colours.first import draw_first, first_json, first_text
from tools.colours.footage import Gathering, gather
from tools.colours.picture import PNG, draw_palette
from tools.colours.report import to_json, to_text
from tools.colours.verdict import judge
from tools.colours.write import check_target, recoloured, write_config
from tools.open_source import open_source
from tools.request import Clocks
from tools.screen import screen
from tools.suffix import check_suffix
from tracker.errors import OperatorError
from tracker.palette.learn import NoMarkerError, learn
from tracker.palette.moving import FirstLook, look_first
from tracker.rig import Colour, Rig

LEAST_FRAMES, MOST_FRAMES = 10, 100_000


@dataclass(frozen=True, slots=True)
class ColoursRequest:
    """One lesson. config: name or path.  frames: read at most, of each camera.  picture, write: files, None for none.

    Raises:
        OperatorError: fewer than 10 or more than 100,000 frames.
    """

    config: str
    source: str
    frames: int
    picture: Path | None
    write: Path | None
    overwrite: bool
    as_json: bool

    def __post_init__(self) -> None:
        if not LEAST_FRAMES <= self.frames <= MOST_FRAMES:
            raise OperatorError(
                f"--frames: {self.frames} frames must be {LEAST_FRAMES} to {MOST_FRAMES}; give a number within"
            )


def run_colours(request: ColoursRequest, clocks: Clocks) -> bool:
    """Learn, show and write; say whether the colours are good to fly with.

    Cameras of which nobody knows where they stand are looked through one at a time (`tools.colours.first`).

    Raises:
        OperatorError: bad input, or no marker in the footage.
    """
    if request.write is not None:
        check_target(request.write, "--write", request.overwrite)
    if request.picture is not None:
        check_suffix(request.picture, "--picture", PNG)
        check_target(request.picture, "--picture", overwrite=True)
    settings = load_settings(request.config)
    chosen, gathering = _watch(request, settings, clocks)
    try:
        palette = learn(gathering.kept, chosen.rig, tuning_of(settings.tracker))
    except NoMarkerError:
        if not chosen.nominal:
            raise
        _show_first(request, look_first(gathering.kept, chosen.rig), gathering, chosen.rig)
        return False
    verdict = judge(palette)
    if request.picture is not None:
        draw_palette(palette, request.picture)
    if request.write is not None:
        _write(request.write, request.config, {lesson.name: lesson.new for lesson in palette.balls})
    page = to_json(palette, verdict) if request.as_json else to_text(palette, verdict, request.source)
    sys.stdout.write(page + "\n")
    return verdict.good


def _show_first(request: ColoursRequest, look: FirstLook, gathering: Gathering, rig: Rig) -> None:
    """Show and write what the cameras showed one at a time."""
    if request.picture is not None:
        draw_first(look, gathering.kept, rig, request.picture)
    if request.write is not None:
        names = [ball.name for ball in rig.marker.balls]
        _write(request.write, request.config, dict(zip(names, look.colours, strict=True)))
    page = first_json(look, rig) if request.as_json else first_text(look, rig, request.source)
    sys.stdout.write(page + "\n")


def _watch(request: ColoursRequest, settings: Settings, clocks: Clocks) -> tuple[ChosenRig, Gathering]:
    """Read the source."""
    console = screen(stderr=True)
    with ExitStack() as stack:
        opened = open_source(request.source, settings, clocks)
        stack.enter_context(opened.source)
        for warning in opened.warnings:
            console.print(f"posebridge: warning: {warning}", style="yellow", soft_wrap=True)
        if opened.live:
            said = f"watching {request.frames} frames of each camera: carry the vehicle slowly through the room"
            console.print(f"posebridge: {said}", soft_wrap=True)
        sizes_px = tuple((camera.width_px, camera.height_px) for camera in opened.chosen.rig.cameras)
        gathering = gather(opened.source, sizes_px, request.frames)
    if not gathering.kept:
        raise OperatorError(
            f"colours {request.source}: no instant with a picture of each of {len(sizes_px)} cameras, within 50 ms and "
            "of the calibration's size; check that every camera gives frames"
        )
    return opened.chosen, gathering


def _write(target: Path, config: str, colours: Mapping[str, Colour]) -> None:
    path = config_path(config)
    text = path.read_text(encoding="utf-8")
    write_config(target, recoloured(text, colours, path.resolve().parent, target.resolve().parent))
