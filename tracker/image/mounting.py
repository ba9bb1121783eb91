"""What a vehicle has about each of its balls, learned: the tube that holds it, a fuselage, a skid.

All of that is fixed to the ball: wherever it is seen from, it leads from its centre into one direction of the body. A
fit that leaves more there than elsewhere, in view after view, tells which; its pixels are then believed less. What is
behind a ball for a while, such as a bookshelf in a hover, counts as long as it is there.
"""

from __future__ import annotations

import math

import numpy as np

from tracker.image.centre import Centre, numbers_of, templates_of
from tracker.image.holder import EXCESS, WITHIN
from tracker.image.newton import TUKEY
from tracker.image.patch import TRUST, Expected, X, Y, cut, extent_of
from tracker.image.reading import LUMA_VAR
from tracker.image.robust import without_strangers
from tracker.image.view import RAY_X, RAY_Y
from tracker.maths.compiled import compiled
from tracker.maths.sphere import spread
from tracker.rig import Marker
from tracker.types import Array, Image

DIRECTIONS = 200  # of the body, evenly spread: 14 deg apart
SECTORS = 24  # of an image round a ball
MOST = 3  # things about one ball
FORGETTING = 0.995  # a view
ENOUGH, SLOWLY = 30, 30  # views until a direction is judged, and more until it counts in full
BUSY = 2.0  # times what a fit leaves on average: far more than chance gives in so many views
FORESHORTENED = 0.5  # what looks shorter than this share of its length tells little of its direction
END_ON = 0.35  # and shorter than this it is before the ball or behind it
APART = math.cos(math.radians(35.0))  # things about one ball lead into directions no closer than this
SAME = math.cos(math.radians(25.0))  # directions this close to a thing's are judged with it
BESIDE = 2  # sectors: what is seen no further from a thing may be the thing
D_X, D_Y, D_Z, STRANGE, THING = range(5)
"""Of a thing about a ball: a unit vector in B from the ball's centre, and by how much more than elsewhere its pixels
leave, squared; 0 for nothing."""

SPHERE = spread(DIRECTIONS)


class Mounting:
    """What is known of the things about a marker's balls.

    things (balls, MOST, THING): by D_X and so on, the busiest first.
    """

    def __init__(self, marker: Marker) -> None:
        self._busy = np.ones((len(marker), DIRECTIONS))
        self._views = np.zeros((len(marker), DIRECTIONS))
        self.things = np.zeros((len(marker), MOST, THING))

    def learn(self, image: Image, ball: Expected, which: int, found: Centre, R_BtoC: Array) -> None:
        """Learn from one fitted ball.

        Args:
            image: (height, width, 3) BGR.
            ball, found: what was expected of the ball, the ray to it known, and what its fit gave.
            which: its index in the marker.
            R_BtoC: (3, 3) the vehicle's attitude as the camera sees it.
        """
        if ball.ray is None:
            raise ValueError("the ray to the ball is not known: a direction is seen along it")
        extent = extent_of(ball)
        u, v = float(found.uv_px[0]) - extent.u, float(found.uv_px[1]) - extent.v
        pixels, (luma, _) = cut(image, extent, ball).bright, templates_of(ball)
        believed = without_strangers(pixels, *luma, numbers_of(ball), LUMA_VAR, u, v)
        squares = np.zeros(SECTORS)
        if _strange(pixels, believed, u, v, WITHIN * ball.radius_px, squares):
            _learn(squares, *ball.ray, R_BtoC, self._busy[which], self._views[which], self.things[which])


@compiled("i8(f8, f8)", inline=True)
def _sector(x: float, y: float) -> int:
    return round(math.atan2(y, x) / (2.0 * math.pi) * SECTORS) % SECTORS


@compiled("b1(f8[:, ::1], f8[:, ::1], f8, f8, f8, f8[::1])")
def _strange(pixels: Array, believed: Array, u: float, v: float, least_px: float, squares: Array) -> bool:
    """Fill in what the sectors round a centre (u, v) leave, mean squares over those of all; NaN where no pixel is.

    pixels, believed (..., n): a patch before and after `without_strangers`, whose weights tell the squares.
    least_px: pixels nearer to the centre do not count.
    Returns whether anything is left at all.
    """
    counts, total, count = np.zeros(SECTORS), 0.0, 0.0
    for i in range(pixels.shape[1]):
        x, y = pixels[X, i] - u, pixels[Y, i] - v
        if x * x + y * y < least_px**2 or pixels[TRUST, i] < 0.0:  # what is full shows nothing else
            continue
        square = TUKEY**2 * (1.0 - believed[TRUST, i] / pixels[TRUST, i])
        k = _sector(x, y)
        squares[k] += square
        counts[k] += 1.0
        total += square
        count += 1.0
    for k in range(SECTORS):
        squares[k] *= count / (counts[k] * total)
    return total > 0.0


@compiled("f8(f8[:, ::1], Array(f8, 1, 'C', True), f8, f8, f8[::1])")
def _lead(R_BtoC: Array, d_inB: Array, ray_x: float, ray_y: float, seen: Array) -> float:
    """Fill in where what goes from a ball into a direction leads to in the image (2,), a unit vector.

    Returns which share of its length is seen.
    Source: the derivative of the image point (X / Z, Y / Z) by a step along d, times Z.
    """
    x = R_BtoC[0, 0] * d_inB[D_X] + R_BtoC[0, 1] * d_inB[D_Y] + R_BtoC[0, 2] * d_inB[D_Z]
    y = R_BtoC[1, 0] * d_inB[D_X] + R_BtoC[1, 1] * d_inB[D_Y] + R_BtoC[1, 2] * d_inB[D_Z]
    z = R_BtoC[2, 0] * d_inB[D_X] + R_BtoC[2, 1] * d_inB[D_Y] + R_BtoC[2, 2] * d_inB[D_Z]
    u, v = x - ray_x * z, y - ray_y * z
    length = math.sqrt(u * u + v * v)
    seen[0], seen[1] = u / max(length, 1e-9), v / max(length, 1e-9)
    return length


@compiled("f8(Array(f8, 1, 'C', True), Array(f8, 1, 'C', True))", inline=True)
def _cosine(a: Array, b: Array) -> float:
    return float(a[D_X] * b[D_X] + a[D_Y] * b[D_Y] + a[D_Z] * b[D_Z])


@compiled("void(f8[::1], f8[::1], f8[:, ::1])")
def _pick(busy: Array, views: Array, things: Array) -> None:
    """Fill in the busiest directions, each apart from those before, amid its busy neighbours, and slowly at first.

    A thing that came at once, or leapt to a neighbour, would move the ball's centre as a flight does.
    """
    things[:] = 0.0
    for m in range(MOST):
        best, most = -1, BUSY
        for k in range(DIRECTIONS):
            apart = views[k] >= ENOUGH and busy[k] > most
            for other in range(m):
                apart = apart and _cosine(SPHERE[k], things[other]) < APART
            if apart:
                best, most = k, busy[k]
        if best < 0:
            return
        for k in range(DIRECTIONS):
            if _cosine(SPHERE[k], SPHERE[best]) > SAME and busy[k] > 1.0:
                for i in range(STRANGE):
                    things[m, i] += (busy[k] - 1.0) * SPHERE[k, i]
        things[m, :STRANGE] /= math.sqrt(_cosine(things[m], things[m]))
        things[m, STRANGE] = (most - 1.0) * min(1.0, (views[best] - ENOUGH) / SLOWLY)


@compiled("void(f8[::1], f8, f8, f8[:, ::1], f8[::1], f8[::1], f8[:, ::1])")
def _learn(squares: Array, ray_x: float, ray_y: float, R_BtoC: Array, busy: Array, views: Array, things: Array) -> None:
    """Learn how busy directions (DIRECTIONS,) are by what sectors leave, and which things (MOST, THING) that shows.

    What a thing explains tells nothing of the directions that are seen beside it only now.
    """
    seen, sectors = np.empty(2), np.full(MOST, -1)
    for m in range(MOST):
        if things[m, STRANGE] > 0.0 and _lead(R_BtoC, things[m], ray_x, ray_y, seen) > END_ON:
            sectors[m] = _sector(seen[0], seen[1])
    for k in range(DIRECTIONS):
        if _lead(R_BtoC, SPHERE[k], ray_x, ray_y, seen) < FORESHORTENED:
            continue
        sector, explained = _sector(seen[0], seen[1]), False
        for m in range(MOST):
            off = abs(sector - sectors[m])
            beside = sectors[m] >= 0 and min(off, SECTORS - off) <= BESIDE
            explained = explained or (beside and _cosine(SPHERE[k], things[m]) < SAME)
        if explained or not np.isfinite(squares[sector]):
            continue
        views[k] = FORGETTING * views[k] + 1.0
        busy[k] += (squares[sector] - busy[k]) / views[k]
    _pick(busy, views, things)


@compiled("f8[:, :, ::1](f8[::1], f8[::1], f8[:, ::1], f8[:, :, ::1])")
def things_seen(mean: Array, camera: Array, views: Array, things: Array) -> Array:
    """Return where in an image the things about each ball lead to (balls, MOST, 3), see `holder.EXCESS`.

    Args:
        mean: of a state.  camera: a row of `camera_table`.
        views: of `view.expected_views`.
        things: see `Mounting`.
    """
    seen, R_BtoC = np.zeros((len(things), MOST, 3)), np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                R_BtoC[i, j] += camera[12 + 3 * k + i] * mean[3 + 3 * k + j]
    for b in range(len(things)):
        for m in range(MOST):
            if things[b, m, STRANGE] <= 0.0:
                break
            if _lead(R_BtoC, things[b, m], views[b, RAY_X], views[b, RAY_Y], seen[b, m]) > END_ON:
                seen[b, m, EXCESS] = things[b, m, STRANGE]
    return seen
