"""What a calibration means for a flight: good, or not and why."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tools.calibrate.intrinsics import Intrinsics
from tools.calibrate.stereo import Stereo
from tools.calibrate.views import coverage

LEAST_VIEWS = 10
LEAST_COVERAGE = 0.7  # a third of the picture without a corner is too much
TILTED_DEG, LEAST_TILTED = 15.0, 4  # views whose board leans so far: only they tell focal length from distance
LEAST_LEAN_DEG = 5.0  # rms about the axis that has less of it
LARGEST_RMS_PX = 1.0
HELD_OUT_RATIO = 1.5
LARGEST_FOCAL_MM = 10.0  # at the flight distance
STEREO_RATIO = 2.0


@dataclass(frozen=True, slots=True)
class Verdict:
    """against: reasons not to fly with it, each with its remedy.  notes: worth knowing."""

    against: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def good(self) -> bool:
        """Say whether nothing speaks against it."""
        return not self.against


def judge(camera: Intrinsics, distance_m: float) -> Verdict:
    """Judge one camera's lens.

    Args:
        distance_m: from the camera to where is flown [m].
    """
    reasons = (*_of_views(camera), *_of_fit(camera), *_of_certainty(camera, distance_m))
    return Verdict(tuple(reasons), tuple(_notes(camera)))


def judge_pair(pair: Stereo, one: Intrinsics, other: Intrinsics) -> Verdict:
    """Judge two cameras' relative pose."""
    alone_px = max(one.lens.rms_px, other.lens.rms_px)
    if pair.rms_px <= STEREO_RATIO * alone_px:
        return Verdict((), ())
    return Verdict(
        (
            f"together they fit to {pair.rms_px:.2f} px, each alone to {alone_px:.2f} px: the pictures are not of the "
            "same instants, a camera moved, or the board is larger than --corners; hold it still for each view",
        ),
        (),
    )


def share_covered(camera: Intrinsics) -> float:
    """Return the share of the picture's cells that had a corner."""
    return float((coverage(list(camera.views), camera.size_px) > 0).mean())


def focal_mm(camera: Intrinsics, distance_m: float) -> float:
    """Return how far one sigma of the focal length moves a point along its ray [mm]: distance times sigma_f / f."""
    return float(1e3 * distance_m * (camera.sigmas_px[:2] / camera.lens.intrinsics[:2]).max())


def centre_mm(camera: Intrinsics, distance_m: float) -> float:
    """Return how far one sigma of the centre moves a point across its ray [mm]."""
    return float(1e3 * distance_m * (camera.sigmas_px[2:] / camera.lens.intrinsics[:2]).max())


def weaker_lean_deg(camera: Intrinsics) -> float:
    """Return the rms lean of the board about the picture's axis that has less of it [deg]."""
    leans_deg = np.degrees(np.arcsin(np.clip(camera.lens.normals[:, :2], -1.0, 1.0)))
    return float(np.sqrt(max(0.0, np.linalg.eigvalsh(leans_deg.T @ leans_deg / len(leans_deg))[0])))


def _of_views(camera: Intrinsics) -> Iterator[str]:
    if len(camera.views) < LEAST_VIEWS:
        yield f"too few views: {len(camera.views)}, at least {LEAST_VIEWS}: show the board in more places"
    tilted = int((camera.lens.tilts_deg >= TILTED_DEG).sum())
    if tilted < LEAST_TILTED:
        yield (
            f"no tilt: {tilted} views with the board leaning {TILTED_DEG:.0f} deg or more, at least {LEAST_TILTED}: "
            "flat on, a longer lens and a further board look the same; tilt it by 30 deg, each way"
        )
    elif (lean_deg := weaker_lean_deg(camera)) < LEAST_LEAN_DEG:
        yield f"tilt about one axis only ({lean_deg:.0f} deg about the other): tilt it up and down, and left and right"
    share = share_covered(camera)
    if share < LEAST_COVERAGE:
        yield (
            f"coverage {100 * share:.0f} %, at least {100 * LEAST_COVERAGE:.0f} %: distortion is a guess where no "
            "corner was; show the board along the edges and in the corners"
        )


def _of_fit(camera: Intrinsics) -> Iterator[str]:
    rms_px, held_out_px = camera.lens.rms_px, camera.held_out.rms_px
    if rms_px > LARGEST_RMS_PX:
        yield (
            f"error {rms_px:.2f} px, at most {LARGEST_RMS_PX:.1f} px: a bent board, another board than told, or a lens "
            "beyond the model; glue it flat, check --corners and --board"
        )
    if held_out_px > HELD_OUT_RATIO * rms_px:
        yield (
            f"views held out err by {held_out_px:.2f} px, fitted ones by {rms_px:.2f} px: the lens follows these "
            "views, not the camera; take more of them, or fewer --coefficients"
        )


def _of_certainty(camera: Intrinsics, distance_m: float) -> Iterator[str]:
    error_mm = focal_mm(camera, distance_m)
    if error_mm > LARGEST_FOCAL_MM:
        yield (
            f"focal length uncertain by {camera.sigmas_px[:2].max():.2f} px, {error_mm:.1f} mm at {distance_m:g} m, "
            f"at most {LARGEST_FOCAL_MM:.0f} mm: more views, nearer and tilted more"
        )


def _notes(camera: Intrinsics) -> Iterator[str]:
    if camera.dropped:
        yield f"left out, since they contradict the others: {', '.join(camera.dropped)}"
    fit_px, held_px = camera.lens.sigmas_px[:2].max(), camera.held_out.sigmas_px[:2].max()
    if held_px > 2.0 * fit_px:
        yield (
            f"leaving views out moves the focal length by {held_px:.2f} px, the fit itself claims {fit_px:.2f} px: "
            "whole views err together (a board not quite flat, a lens not quite the model); the larger figure counts"
        )
