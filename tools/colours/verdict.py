"""What a palette means for a flight: reasons against it, and what to do."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tracker.palette.background import Clash, ClashKind
from tracker.palette.chroma import hue_from
from tracker.palette.learn import BallLesson, Palette

LEAST_SIGHTINGS = 5  # in each of two cameras
LEAST_GAP_DEG = 6.0  # of hue between two balls: a 20 % cast turns hues by up to 20 deg, but not apart
PALE_SATURATION, DARK_VALUE = 0.2, 0.08
CAMERAS_APART_DEG, DARKER_SHARE = 8.0, 0.65
FOUND_SHARE, LEAST_FOUND = 0.9, 0.3
STILL_M = 0.15
SHOWN_CLOSE = 2  # regions that nearly clash, of each ball


@dataclass(frozen=True, slots=True)
class Verdict:
    """against: by ball, reasons not to fly with it.  general: reasons that no one ball has.  notes: worth knowing."""

    against: tuple[tuple[str, ...], ...]
    general: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def good(self) -> bool:
        """Say whether nothing speaks against a flight."""
        return not self.general and not any(self.against)


def judge(palette: Palette) -> Verdict:
    """Say what speaks against flying with a palette."""
    names = tuple(camera.name for camera in palette.rig.cameras)
    against = tuple(tuple(_against(ball, lesson, palette, names)) for ball, lesson in enumerate(palette.balls))
    return Verdict(against, tuple(_general(palette)), tuple(_notes(palette, names)))


def clash_line(clash: Clash, palette: Palette) -> str:
    """Describe a clash in one line: where, what, how near, what to do."""
    ball, camera = palette.balls[clash.ball].name, palette.rig.cameras[clash.camera].name
    box = clash.region
    where = f"{camera}, columns {box.left}..{box.right - 1}, rows {box.top}..{box.bottom - 1}"
    apart = f"{clash.apart_deg:.0f} deg and {clash.apart_sigma:.1f} sigma"
    end, remedy = {
        ClashKind.LOOKS_LIKE: ("is taken for a ball", "cover or remove it, or repaint the ball"),
        ClashKind.HIDES: ("hides the ball before it", "cover it, or repaint the ball"),
        ClashKind.CLOSE: ("nearly passes as the ball", "keep the light as it is, or cover it"),
    }[clash.kind]
    return f"{where}: {clash.area_px} px of hue {clash.hue_deg:.0f} deg, {apart} from {ball}, {end}; {remedy}"


def shown_clashes(palette: Palette) -> list[Clash]:
    """Return the serious clashes and the first few of each ball that are only close."""
    shown = [clash for clash in palette.clashes if clash.serious]
    for ball in range(len(palette.balls)):
        shown += [clash for clash in palette.clashes if clash.ball == ball and not clash.serious][:SHOWN_CLOSE]
    return shown


def _against(ball: int, lesson: BallLesson, palette: Palette, names: tuple[str, ...]) -> Iterator[str]:
    second = sorted(lesson.sightings)[-2]
    if second < LEAST_SIGHTINGS:
        seen = ", ".join(f"{name} {count}" for name, count in zip(names, lesson.sightings, strict=True))
        yield f"seen too seldom ({seen}; at least {LEAST_SIGHTINGS} in two cameras): show it for longer"
    if lesson.gap_deg < LEAST_GAP_DEG:
        yield (
            f"its hues lie {lesson.gap_deg:.0f} deg from those of {lesson.neighbour}, needed {LEAST_GAP_DEG:.0f} deg: "
            + (
                "set one white balance for all cameras"
                if _apart_deg(lesson) > CAMERAS_APART_DEG
                else "repaint one of them"
            )
        )
    if lesson.paint.saturation < PALE_SATURATION:
        yield f"pale: saturation {lesson.paint.saturation:.2f}, least {PALE_SATURATION}: less glare or stronger paint"
    if lesson.paint.value < DARK_VALUE:
        yield f"dark: value {lesson.paint.value:.2f}, at least {DARK_VALUE}: more light or a longer exposure"
    serious = [clash for clash in palette.clashes if clash.ball == ball and clash.serious]
    for kind, words in ((ClashKind.LOOKS_LIKE, "look like it"), (ClashKind.HIDES, "would hide it")):
        places = [names[clash.camera] for clash in serious if clash.kind is kind]
        if places:
            count = ", ".join(f"{name} {places.count(name)}" for name in names if name in places)
            yield f"things in the room {words} ({count}): cover them"


def _general(palette: Palette) -> Iterator[str]:
    found = palette.searched[1] / len(palette.seen)
    if found < FOUND_SHARE:
        yield (
            f"with these colours the tracker finds the marker in {100 * found:.0f} % of the instants that show "
            f"it, at least {100 * FOUND_SHARE:.0f} %: see the balls' reasons, and the picture"
        )


def _notes(palette: Palette, names: tuple[str, ...]) -> Iterator[str]:
    if len(palette.seen) < LEAST_FOUND * palette.instants:
        found = f"only {len(palette.seen)} of {palette.instants} instants"
        yield f"the marker was found in {found}; keep it in view of two cameras"
    if palette.moved_m < STILL_M:
        yield (
            f"the vehicle moved {100 * palette.moved_m:.0f} cm, less than {100 * STILL_M:.0f} cm: balls were seen in "
            "one light and the room behind them was not seen; carry it around"
        )
    elif palette.unknown > 0:
        yield f"{100 * palette.unknown:.2f} % of the pictures were never seen without the vehicle, and not checked"
    for lesson in palette.balls:
        if (apart := _apart_deg(lesson)) > CAMERAS_APART_DEG:
            hues = ", ".join(f"{name} {hue:.0f} deg" for name, hue in zip(names, lesson.hues_deg, strict=True))
            yield f"{lesson.name} has another hue in each camera ({hues}; {apart:.0f} deg apart): set one white balance"
    bright = np.array(palette.brightness)
    if np.nanmin(bright) < DARKER_SHARE * np.nanmax(bright):
        values = ", ".join(f"{name} {value:.2f}" for name, value in zip(names, bright, strict=True))
        yield f"balls are not equally bright in all cameras (value {values}): set one exposure"


def _apart_deg(lesson: BallLesson) -> float:
    """Return how far the hues of one ball lie apart in different cameras."""
    hues = [hue for hue in lesson.hues_deg if not np.isnan(hue)]
    return max(abs(float(hue_from(a, b))) for a in hues for b in hues)
