"""One `posebridge place`: limits in; page, pictures and config out."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

from bridge.settings import Settings, load_settings, rig_of
from tools.place.layout import FINE, asked_move, every_move, survey, what_if
from tools.place.limits import Limits, Wishes, check_count, limits_of
from tools.place.map_picture import draw_map
from tools.place.paper_page import paper_page
from tools.place.paper_picture import draw_axes, draw_cones
from tools.place.proof import prove
from tools.place.report import Placement, to_json, to_text
from tools.place.search import Search
from tools.place.words import config_with, snippet
from tracker.camera import Camera
from tracker.errors import OperatorError

MOVE_M = 0.5


@dataclass(frozen=True, slots=True)
class PlaceRequest:
    """One question. config: name or path.  cameras: how many to place; None: judge the config's own.
    moves: `cam1:0.5,0,0`; none: every camera along every axis.  out: folder, None for none.

    Raises:
        OperatorError: fewer than 2 or more than 8 cameras.
    """

    config: str
    cameras: int | None
    wishes: Wishes
    moves: tuple[str, ...]
    out: Path | None
    seed: int
    fly: bool
    as_json: bool

    def __post_init__(self) -> None:
        if self.cameras is not None:
            check_count(self.cameras)
        if self.seed < 0:
            raise OperatorError(f"--seed: {self.seed} must be 0 or more; give another number")


def run_place(request: PlaceRequest) -> bool:
    """Search or take the config's cameras, judge them, write what was asked for; say whether they are good.

    Raises:
        OperatorError: bad input, or no place from which the volume is seen.
    """
    settings = load_settings(request.config)
    limits = limits_of(settings, request.wishes)
    folder = made(request.out)
    cameras = _cameras(request, settings, limits)
    wanted = [asked_move(text, cameras, limits) for text in request.moves]
    found = survey(cameras, limits, FINE)
    placement = Placement(
        cameras,
        found.figures,
        tuple(what_if(cameras, limits, wanted or every_move(len(cameras), MOVE_M))),
        prove(cameras, limits, request.config, request.seed) if request.fly else None,
        request.cameras is not None,
    )
    if folder is not None:
        _write(folder / "cameras.toml", snippet(cameras, limits))
        _write(folder / "room.toml", config_with(request.config, cameras, limits))
        _write(folder / "place.json", to_json(placement, limits) + "\n")
        draw_map(found, cameras, limits, folder / "map.png")
    page = to_json(placement, limits) if request.as_json else to_text(placement, limits)
    sys.stdout.write(page + "\n")
    return placement.good(limits)


def run_paper(out: Path | None, as_json: bool) -> None:
    """Print the paper's tables beside ours, and redraw its figures 3 and 4 where a folder is given.

    Raises:
        OperatorError: a folder that cannot be made.
    """
    folder = made(out)
    if folder is not None:
        draw_cones(folder / "fig3.png")
        draw_axes(folder / "fig4.png")
    sys.stdout.write(paper_page(as_json) + "\n")


def made(folder: Path | None) -> Path | None:
    """Make the folder for what is written.

    Raises:
        OperatorError: it cannot be made.
    """
    if folder is not None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OperatorError(f"--out {folder}: cannot be made ({error.strerror}); name another folder") from error
    return folder


def _cameras(request: PlaceRequest, settings: Settings, limits: Limits) -> tuple[Camera, ...]:
    if request.cameras is None:
        return rig_of(settings, None).rig.cameras
    search = Search(limits, _tell)
    stands = search.best(request.cameras, request.seed)
    return tuple(stand.camera(f"cam{k}") for k, stand in enumerate(stands))


def _tell(line: str) -> None:
    sys.stderr.write(f"posebridge: {line}\n")


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise OperatorError(f"{path}: cannot be written ({error.strerror}); name another --out") from error
