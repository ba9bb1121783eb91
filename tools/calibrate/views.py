"""The views to calibrate by: sharp ones, each showing the board where or how it was not yet shown."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from tools.calibrate.find import View
from tracker.types import Array

NOVEL = 0.05  # of the image's diagonal: how far the board's corners must have gone, on the mean
MOST = 60  # instants; beyond, those most alike are let go
BLURRED_PX = 4.5  # width of an edge: twice that of a sharp one
SHARPER = 0.8  # of a like view's width: worth taking its place
CELLS = (8, 6)  # across and down, of the map of coverage
Views = Mapping[int, View]


@dataclass
class Gathering:
    """Instants as they come. chosen: somebody chose them, so that only blurred ones are left out.

    sizes_px: (width, height) by camera.  count, shown, blurred: pictures looked at, with a board, too blurred.
    """

    sizes_px: dict[int, tuple[int, int]]
    chosen: bool
    kept: list[Views] = field(default_factory=list)
    count: int = 0
    shown: dict[int, int] = field(default_factory=dict)
    blurred: int = 0
    novel: float = NOVEL

    def take(self, found: Mapping[int, View | None]) -> bool:
        """Take what the cameras saw at one instant; say whether it taught anything."""
        self.count += len(found)
        views: dict[int, View] = {}
        for camera, view in found.items():
            if view is None:
                continue
            self.shown[camera] = self.shown.get(camera, 0) + 1
            if view.edge_px <= BLURRED_PX:
                views[camera] = view
            else:
                self.blurred += 1
        if not views:
            return False
        if self.chosen:
            self.kept.append(views)
            return True
        return self._taken(views)

    def _taken(self, views: Views) -> bool:
        likes = [self._like(camera, view) for camera, view in views.items()]
        if any(like is None for like in likes):
            self.kept.append(views)
            while len(self.kept) > MOST:
                self._thin()
            return True
        # One like it is there for every camera: a sharper one that shows as much takes its place.
        like = likes[0]
        if like is not None and set(self.kept[like]) <= set(views) and _edge(views) < SHARPER * _edge(self.kept[like]):
            self.kept[like] = views
        return False

    def _like(self, camera: int, view: View) -> int | None:
        """Return the first kept instant in which a camera saw nearly the same."""
        diagonal_px = float(np.hypot(*self.sizes_px[camera]))
        for k, other in enumerate(self.kept):
            if camera in other and apart_px(view, other[camera]) < self.novel * diagonal_px:
                return k
        return None

    def _thin(self) -> None:
        """Ask for more novelty, and take all kept instants again under it."""
        self.novel *= 1.15
        kept, self.kept = self.kept, []
        for views in kept:
            if any(self._like(camera, view) is None for camera, view in views.items()):
                self.kept.append(views)

    def of(self, camera: int) -> list[View]:
        """Return one camera's views."""
        return [views[camera] for views in self.kept if camera in views]

    def coverage(self, camera: int) -> Array:
        """Return how many corners each cell of one camera's picture has had: (6, 8)."""
        return coverage(self.of(camera), self.sizes_px[camera])


def apart_px(one: View, other: View) -> float:
    """Return how far the board's outermost corners lie apart in two pictures, on the mean [px].

    One measure for place, size, tilt and turn: all of them move these corners.
    """
    return float(np.linalg.norm(one.outline_px - other.outline_px, axis=1).mean())


def coverage(views: list[View], size_px: tuple[int, int]) -> Array:
    """Count corners in the cells of a picture of (width, height) px: (6, 8)."""
    if not views:
        return np.zeros(CELLS[::-1])
    uv_px = np.vstack([view.uv_px for view in views])
    ranges = ((-0.5, size_px[0] - 0.5), (-0.5, size_px[1] - 0.5))
    counts, _, _ = np.histogram2d(uv_px[:, 0], uv_px[:, 1], bins=CELLS, range=ranges)
    return np.asarray(counts.T)


def where_to_go(counts: Array) -> str:
    """Name the part of the picture, of nine, that has had least."""
    rows, columns = np.array_split(np.arange(CELLS[1]), 3), np.array_split(np.arange(CELLS[0]), 3)
    shares = [[float((counts[np.ix_(r, c)] > 0).mean()) for c in columns] for r in rows]
    row, column = np.unravel_index(int(np.argmin(shares)), (3, 3))
    down, across = ("top", "middle", "bottom")[row], ("left", "middle", "right")[column]
    return "middle" if down == across == "middle" else f"{down} {across}"


Tell = Callable[[str], None]
"""Say one line to the operator."""


def _edge(views: Views) -> float:
    return max(view.edge_px for view in views.values())
