"""The Cramer-Rao bounds of a recording's ball images and poses, from its own images and truth."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from tools.bench.bound import parameter_bound, pose_bound
from tools.bench.noise import TO_YCC, Noise, measure_noise
from tools.bench.profile import TERMS, Disc, columns, draw
from tracker.filter.measure import predicted_pixels
from tracker.rig import Rig
from tracker.sources.groundtruth import GroundTruth
from tracker.state import ATTITUDE, POSITION, State, mean_of
from tracker.types import Array, Frame, Image

MARGIN_PX = 4
CLEAR_PX = 75  # of the balls, within which the vehicle may have moved between two images
PAIRS = 8  # of images whose difference shows the noise
PASSES = 2  # of the search for blur and exposure
SAMPLE = 10  # balls that blur and exposure are found on
BLURS_PX = (0.25, 0.35, 0.45, 0.55, 0.65, 0.8, 1.0, 1.3)
EXPOSURES_S = (0.0, 0.002, 0.004, 0.006, 0.008)

Key = tuple[int, int, int]
"""Time [ns], camera and ball."""


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """A ball's image and the truth about it: place (2,) [px], radius [px], speed (2,) [px/s]."""

    camera: int
    ball: int
    t_ns: int
    image: Image
    uv_px: Array
    radius_px: float
    speed_px_s: Array

    def patch(self, half: int) -> Array:
        """Return its pixels in luma and colour differences (n, 3)."""
        u, v = np.rint(self.uv_px).astype(int).tolist()
        cut = self.image[v - half : v + half + 1, u - half : u + half + 1]
        return np.asarray(cut.reshape(-1, 3) @ TO_YCC)


@dataclass(frozen=True, slots=True)
class Optics:
    """How a camera smears: blur of luma and of colour, one sigma [px], and exposure [s]."""

    luma_px: float = 0.5
    chroma_px: float = 0.7
    exposure_s: float = 0.0

    def bases(self, seen: Seen, half: int) -> tuple[Array, Array]:
        """Return what its image is made of, for each channel (3, n, TERMS + 3), and the slopes (3, TERMS, n, 2)."""
        streak = tuple((seen.speed_px_s * self.exposure_s).tolist())
        offset = seen.uv_px - np.rint(seen.uv_px)
        luma, chroma = (
            draw(Disc(seen.radius_px, (streak[0], streak[1]), blur), offset, half)
            for blur in (self.luma_px, self.chroma_px)
        )
        parts = (luma, chroma, chroma)
        return np.stack([columns(each, half) for each in parts]), np.stack([each.slopes for each in parts])


def truth_about(frame: Frame, rig: Rig, truth: GroundTruth) -> list[Seen]:
    """Return the truth about the balls in a frame whose instant has a true pose; those near the border are left out."""
    k = int(np.searchsorted(truth.t_ns, frame.t_ns))
    if k >= len(truth.t_ns) or truth.t_ns[k] != frame.t_ns:
        return []
    camera = rig.cameras[frame.camera]
    uv_px = _project(rig, frame.camera, truth, k)
    before, after = max(k - 1, 0), min(k + 1, len(truth.t_ns) - 1)
    moved_px = _project(rig, frame.camera, truth, after) - _project(rig, frame.camera, truth, before)
    speeds = moved_px / max(float(truth.t_ns[after] - truth.t_ns[before]) * 1e-9, 1e-9)
    depths = camera.in_camera(rig.marker.points_inB @ truth.R_BtoW[k].T + truth.p_BinW[k])[:, 2]
    radii = [camera.focal_px * ball.radius_m / depth for ball, depth in zip(rig.marker.balls, depths, strict=True)]
    return [
        Seen(frame.camera, b, frame.t_ns, frame.image, uv_px[b], float(radii[b]), speeds[b])
        for b in range(len(radii))
        if np.isfinite(uv_px[b]).all() and camera.sees(uv_px[b], radii[b] + MARGIN_PX + 4.0)
    ]


def centre_bounds(frames: Sequence[Frame], rig: Rig, truth: GroundTruth) -> dict[Key, Array]:
    """Return the bound (2, 2) [px^2] of every ball image in frames whose instants have a true pose.

    The balls' shading, each camera's blur and its exposure count as known: they are found from all the images at their
    true places. Of each image its brightness in each channel and the background's slope are not known.
    """
    bounds: dict[Key, Array] = {}
    for camera in range(len(rig.cameras)):
        own = [frame for frame in frames if frame.camera == camera]
        seen = [ball for frame in own for ball in truth_about(frame, rig, truth)]
        if len(own) < 2 or not seen:
            continue
        half = int(np.ceil(max(ball.radius_px for ball in seen))) + MARGIN_PX
        noise, optics = _noise(own, seen), _optics(seen, half)
        whiteners = noise.whiteners(half)
        for b in range(len(rig.marker)):
            balls = [ball for ball in seen if ball.ball == b]
            drawn = [optics.bases(ball, half) for ball in balls]
            fits = [_fit(bases, ball.patch(half)) for ball, (bases, _) in zip(balls, drawn, strict=True)]
            shading = np.median([fit[:TERMS] for fit in fits], axis=0) if fits else np.zeros((TERMS, 3))
            for ball, fit, pair in zip(balls, fits, drawn, strict=True):
                made_of = np.concatenate((shading, fit[TERMS:]))
                bounds[(ball.t_ns, camera, b)] = _bound(*pair, made_of, noise, whiteners)
    return bounds


def pose_bounds(bounds: dict[Key, Array], rig: Rig, truth: GroundTruth) -> dict[int, Array]:
    """Return the bound (6, 6) of the pose at each instant [ns] that at least three ball images show."""
    result = {}
    for k, t_ns in enumerate(truth.t_ns.tolist()):
        keys = [key for key in bounds if key[0] == t_ns]
        if len(keys) >= 3:
            there = State(t_ns, mean_of(truth.p_BinW[k], truth.R_BtoW[k]), np.eye(12))
            H = [predicted_pixels(there, rig, camera, t_ns)[1] for camera in range(len(rig.cameras))]
            J = np.stack([np.concatenate((H[c][b][:, POSITION], H[c][b][:, ATTITUDE]), axis=1) for _, c, b in keys])
            result[t_ns] = pose_bound(J, np.stack([bounds[key] for key in keys]))
    return result


def _project(rig: Rig, camera: int, truth: GroundTruth, k: int) -> Array:
    return rig.cameras[camera].project(rig.marker.points_inB @ truth.R_BtoW[k].T + truth.p_BinW[k])[0]


def _noise(frames: Sequence[Frame], seen: Iterable[Seen]) -> Noise:
    """Measure a camera's noise between neighbouring images, well away from the vehicle."""
    places = {frame.t_ns: [ball.uv_px for ball in seen if ball.t_ns == frame.t_ns] for frame in frames}
    step = max(1, (len(frames) - 1) // PAIRS)
    pairs = []
    for before, after in list(pairwise(frames))[::step]:
        still = np.ones(before.image.shape[:2], dtype=bool)
        for u, v in np.rint(np.reshape(places[before.t_ns] + places[after.t_ns], (-1, 2))).astype(int).tolist():
            still[max(v - CLEAR_PX, 0) : v + CLEAR_PX, max(u - CLEAR_PX, 0) : u + CLEAR_PX] = False
        pairs.append((before.image, after.image, still))
    return measure_noise(pairs)


def _optics(seen: Sequence[Seen], half: int) -> Optics:
    """Find a camera's blur and exposure: those with which the balls at their true places leave least unexplained."""
    sample = seen[:: max(1, len(seen) // SAMPLE)]
    best = Optics()
    for _ in range(PASSES):
        for name, values in (("exposure_s", EXPOSURES_S), ("luma_px", BLURS_PX), ("chroma_px", BLURS_PX)):
            tried = [replace(best, **{name: value}) for value in values]
            best = min(tried, key=lambda optics: _unexplained(optics, sample, half))
    return best


def _unexplained(optics: Optics, sample: Sequence[Seen], half: int) -> float:
    """Return the median over the balls of the mean square that no shading explains; chroma is the quieter part."""
    rests = []
    for seen in sample:
        bases, _ = optics.bases(seen, half)
        image = seen.patch(half)
        rests.append(sum(np.linalg.lstsq(bases[c], image[:, c], rcond=None)[1].sum() for c in range(3)))
    return float(np.median(rests))


def _fit(bases: Array, image: Array) -> Array:
    """Return the shading and background (TERMS + 3, 3) that a ball's image (n, 3) shows at its true place."""
    return np.stack([np.linalg.lstsq(bases[c], image[:, c], rcond=None)[0] for c in range(3)], axis=1)


def _bound(bases: Array, slopes: Array, made_of: Array, noise: Noise, whiteners: Array) -> Array:
    """Return the bound (2, 2) of one ball's centre; made_of (TERMS + 3, 3) is its shading and background."""
    n = bases.shape[1]
    wanted, nuisance = np.empty((n, 3, 2)), np.zeros((n, 3, 12))
    for c in range(3):
        behind = bases[c][:, TERMS:] @ made_of[TERMS:, c] / np.maximum(1.0 - bases[c][:, 0], 1e-9)
        wanted[:, c] = np.einsum("t,tnk->nk", made_of[:TERMS, c], slopes[c]) - slopes[c, 0] * behind[:, None]
        nuisance[:, c, 4 * c] = bases[c][:, :TERMS] @ made_of[:TERMS, c]
        nuisance[:, c, 4 * c + 1 : 4 * c + 4] = bases[c][:, TERMS:]
    white = noise.whitened(np.concatenate((wanted, nuisance), axis=2), bases[0] @ made_of[:, 0], whiteners)
    return parameter_bound(white[:, :2], white[:, 2:])
