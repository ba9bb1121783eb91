"""Residuals of all sightings, with their sparse Jacobian."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from tools.calibrate.room.scene import Indices, Scene, Seen
from tracker.types import Array

POSE, CAMERA, LENS = 6, 7, 3
OFFSET_SIGMA_S, FOCAL_SIGMA, CENTRE_SIGMA_PX, BALL_SIGMA_M = 0.05, 0.005, 3.0, 0.02  # what is known beforehand
WEAK = 1e-9  # keeps what nothing tells from making the equations singular


@dataclass(frozen=True, slots=True)
class Layout:
    """Where each unknown stands in the vector of all.

    First, of each camera but 0: position (3) [m], turn (3) [rad], clock offset [s]. Then, if lenses, of each camera:
    the logarithm of its focal length and its centre (2) [px]; if marker, each ball's place in B (3) [m]; then of each
    instant the marker's position (3) and turn (3).
    """

    cameras: int
    balls: int
    instants: int
    lenses: bool = False
    marker: bool = False

    def camera(self, c: int) -> slice:
        """Return where camera c >= 1 stands."""
        return slice(CAMERA * (c - 1), CAMERA * c)

    def lens(self, c: int) -> slice:
        """Return where the lens of camera c stands."""
        start = CAMERA * (self.cameras - 1) + LENS * c
        return slice(start, start + LENS)

    @property
    def marker_at(self) -> slice:
        """Return where the balls stand."""
        start = CAMERA * (self.cameras - 1) + LENS * self.cameras * self.lenses
        return slice(start, start + 3 * self.balls)

    @property
    def globals(self) -> int:
        """Return how many unknowns come before the marker's poses."""
        return int(self.marker_at.start) + 3 * self.balls * self.marker

    @property
    def kinds(self) -> int:
        """Return how many kinds of sightings there are: each ball in each camera."""
        return self.cameras * self.balls

    @property
    def size(self) -> int:
        """Return how many unknowns there are."""
        return self.globals + POSE * self.instants

    def prior(self) -> Array:
        """Return the inverse variance of each unknown beforehand (size,)."""
        prior = np.full(self.size, WEAK)
        for c in range(1, self.cameras):
            prior[self.camera(c)][6] = OFFSET_SIGMA_S**-2
        for c in range(self.cameras * self.lenses):
            prior[self.lens(c)] = FOCAL_SIGMA**-2, CENTRE_SIGMA_PX**-2, CENTRE_SIGMA_PX**-2
        if self.marker:
            prior[self.marker_at] = BALL_SIGMA_M**-2
        return prior

    def values(self, scene: Scene) -> Array:
        """Return the values (size,) of those unknowns that have a prior, 0 for the others."""
        values = np.zeros(self.size)
        for c in range(1, self.cameras):
            values[self.camera(c)][6] = scene.offsets_s[c]
        for c in range(self.cameras * self.lenses):
            camera = scene.cameras[c]
            values[self.lens(c)] = np.log(camera.focal_px), camera.K[0, 2], camera.K[1, 2]
        if self.marker:
            values[self.marker_at] = scene.points_inB.reshape(-1)
        return values


def residuals(scene: Scene, seen: Seen) -> Array:
    """Return expected minus seen pixels (2n,): of each camera in turn, at each instant at which it saw, each ball's."""
    uv, there, x_inW = seen.at(scene.offsets_s), seen.there, scene.balls_inW()
    off = [
        camera.project(x_inW[there[c]].reshape(-1, 3))[0] - uv[c, there[c]].reshape(-1, 2)
        for c, camera in enumerate(scene.cameras)
    ]
    return np.concatenate(off).reshape(-1)


def slopes(scene: Scene, seen: Seen, layout: Layout) -> csr_array:
    """Return the Jacobian (2n, size) of the residuals by a step of the unknowns.

    Source: ball m stands at x = p + R m, in the camera at y = R_CtoW' (x - p_C). With Ju = du/dx: du/dp = Ju,
        du/dtheta = -Ju R [m]x, du/dp_C = -Ju, du/dtheta_C = Ju R_CtoW [y]x; u - centre grows with the focal length; a
        camera that sees later by d saw its balls d seconds of their speed further back: r grows by speed * d.
    """
    blocks: list[tuple[Indices, Indices, Array]] = []
    row = 0
    for c in range(len(scene.cameras)):
        instants = np.flatnonzero(seen.there[c])
        count = len(instants) * layout.balls
        rows = row + np.arange(2 * count).reshape(count, 2)
        blocks += [(rows, columns, values) for columns, values in _by_unknown(scene, seen, layout, c, instants)]
        row += 2 * count
    return _sparse(blocks, row, layout.size)


def _by_unknown(scene: Scene, seen: Seen, layout: Layout, c: int, instants: Indices) -> Iterator[tuple[Indices, Array]]:
    """Yield the columns (k, w) and slopes (k, 2, w) of each group of unknowns that one camera's sightings go by."""
    camera, n = scene.cameras[c], layout.balls
    x_inW, m_inB = scene.balls_inW()[instants].reshape(-1, 3), np.tile(scene.points_inB, (len(instants), 1))
    expected, Ju = camera.project(x_inW)
    JR = Ju @ np.repeat(scene.R_BtoW[instants], n, axis=0)
    at = layout.globals + POSE * np.repeat(instants, n)
    yield at[:, None] + np.arange(POSE), np.concatenate((Ju, -JR @ _hats(m_inB)), axis=2)
    if c > 0:
        turn = Ju @ camera.R_CtoW @ _hats(camera.in_camera(x_inW))
        speed = seen.speed[c, instants].reshape(-1, 2, 1)
        columns = np.broadcast_to(np.arange(CAMERA) + layout.camera(c).start, (len(x_inW), CAMERA))
        yield columns, np.concatenate((-Ju, turn, speed), axis=2)
    if layout.lenses:
        by_focal = (expected - camera.K[:2, 2])[:, :, None]
        columns = np.broadcast_to(np.arange(LENS) + layout.lens(c).start, (len(x_inW), LENS))
        yield columns, np.concatenate((by_focal, np.broadcast_to(np.eye(2), (len(x_inW), 2, 2))), axis=2)
    if layout.marker:
        yield layout.marker_at.start + 3 * np.tile(np.arange(n), len(instants))[:, None] + np.arange(3), JR


def _sparse(blocks: list[tuple[Indices, Indices, Array]], rows: int, columns: int) -> csr_array:
    """Put blocks (k, 2, w) at rows (k, 2) and columns (k, w) together."""
    at_rows = [np.broadcast_to(r[:, :, None], v.shape).reshape(-1) for r, _, v in blocks]
    at_columns = [np.broadcast_to(c[:, None, :], v.shape).reshape(-1) for _, c, v in blocks]
    values = np.concatenate([v.reshape(-1) for _, _, v in blocks])
    return csr_array((values, (np.concatenate(at_rows), np.concatenate(at_columns))), shape=(rows, columns))


def _hats(v: Array) -> Array:
    """Return the matrices (k, 3, 3) of the cross products with v (k, 3)."""
    hats = np.zeros((len(v), 3, 3))
    hats[:, [2, 0, 1], [1, 2, 0]] = v
    hats[:, [1, 2, 0], [2, 0, 1]] = -v
    return hats
