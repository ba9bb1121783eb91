"""A made-up laboratory to stand behind the vehicle, another one for each camera and seed."""

from __future__ import annotations

import cv2
import numpy as np

from tracker.scene.sensor import Plane
from tracker.types import Image

_SCALE = 2  # drawn at twice the size and shrunk, so that edges are smooth
_WALLS = ((198, 204, 202), (188, 192, 190), (196, 200, 208))
_FLOORS = ((92, 104, 116), (104, 104, 100), (84, 96, 112))
_THINGS = ((150, 96, 62), (84, 92, 150), (92, 128, 104), (70, 104, 140), (128, 84, 112), (140, 132, 72))
_INKS = ((140, 70, 60), (70, 70, 160), (80, 110, 70), (70, 66, 64))

Bgr = tuple[int, int, int]


def backdrop(width_px: int, height_px: int, rng: np.random.Generator) -> Plane:
    """Draw a room: display values (h, w, 3), 0..255.

    Wall, floor, white board with writing, window, dark cloth, desk with screens, shelf with coloured binders. Colours
    are those of things in rooms, of moderate saturation: nothing here is as bright a colour as the balls.
    """
    room = _Drawing(width_px * _SCALE, height_px * _SCALE, rng)
    room.wall_and_floor()
    room.board()
    room.window()
    room.cloth()
    room.shelf()
    room.desk()
    small = cv2.resize(room.image, (width_px, height_px), interpolation=cv2.INTER_AREA).astype(np.float32)
    return np.asarray(np.clip(small * _unevenness(width_px, height_px, rng), 0, 255), dtype=np.float32)


def vignette(width_px: int, height_px: int, corner: float = 0.78) -> Plane:
    """Return the lens's fall of light (h, w, 1): 1 in the middle, `corner` in the corners, with the radius squared."""
    u = np.linspace(-1.0, 1.0, width_px, dtype=np.float32)
    v = np.linspace(-1.0, 1.0, height_px, dtype=np.float32)[:, None]
    return np.asarray(1.0 - (1.0 - corner) * 0.5 * (u * u + v * v), dtype=np.float32)[..., None]


def _unevenness(width_px: int, height_px: int, rng: np.random.Generator) -> Plane:
    """Return factors near 1: soft patches of light, and the fine grain of plaster and cloth."""
    soft = rng.normal(0.0, 0.05, (5, 6)).astype(np.float32)
    grain = rng.normal(0.0, 0.012, (height_px // 2, width_px // 2)).astype(np.float32)
    size = (width_px, height_px)
    factors = 1.0 + cv2.resize(soft, size, interpolation=cv2.INTER_CUBIC) + cv2.resize(grain, size)
    return np.asarray(factors, dtype=np.float32)[..., None]


class _Drawing:
    """One room in the making; the cursor `x` is how far along the wall things stand already."""

    def __init__(self, width: int, height: int, rng: np.random.Generator) -> None:
        self.image: Image = np.zeros((height, width, 3), dtype=np.uint8)
        self._rng = rng
        self._horizon = int(height * rng.uniform(0.74, 0.82))
        self._x = int(width * rng.uniform(0.03, 0.10))

    def wall_and_floor(self) -> None:
        height, width = self.image.shape[:2]
        self.image[:] = self._pick(_WALLS)
        self.image[self._horizon :] = self._pick(_FLOORS)
        for row in range(1, 6):  # floor boards, closer together the farther away
            y = self._horizon + int((height - self._horizon) * row**2 / 30)
            cv2.line(self.image, (0, y), (width, y), (70, 78, 88), 2)
        self._box(0, self._horizon - 14, width, 14, (150, 154, 158))

    def board(self) -> None:
        x, y, w, h = self._place(0.34, 0.14, 0.36)
        self._box(x, y, w, h, (150, 148, 146))
        self._box(x + 8, y + 8, w - 16, h - 16, (222, 224, 222))
        for line in range(int(h / 26)):
            self._scribble(x + 24, y + 28 + 24 * line, int(w * self._rng.uniform(0.35, 0.9)) - 40)

    def window(self) -> None:
        x, y, w, h = self._place(0.17, 0.06, 0.50)
        self._box(x, y, w, h, (206, 206, 204))
        for column in range(2):
            left = x + 10 + column * (w // 2 - 3)
            self._box(left, y + 10, w // 2 - 16, h - 20, (246, 238, 226))
            self._box(left, y + int(0.65 * h), w // 2 - 16, int(0.35 * h) - 10, (196, 202, 190))

    def cloth(self) -> None:
        x, y, w, h = self._place(0.14, 0.30, 0.55)
        folds = 34 + 14 * np.sin(np.linspace(0, self._rng.uniform(14, 22), w)) + self._rng.normal(0, 2, w)
        bottom = min(y + h, self.image.shape[0])
        self.image[y:bottom, x : x + w] = np.clip(folds, 8, 70)[None, :, None].astype(np.uint8)

    def shelf(self) -> None:
        x, y, w, h = self._place(0.17, 0.34, 0.44)
        self._box(x, y, w, h, (120, 138, 150))
        for level in range(3):
            top, spine = y + 8 + level * h // 3, x + 8
            self._box(x + 6, top, w - 12, h // 3 - 12, (64, 72, 80))
            while spine < x + w - 34:
                thick = int(self._rng.integers(14, 28))
                tall = int((h // 3 - 16) * self._rng.uniform(0.65, 0.98))
                self._box(spine, top + h // 3 - 12 - tall, thick, tall, self._pick(_THINGS))
                spine += thick + 2

    def desk(self) -> None:
        height, width = self.image.shape[:2]
        x, top = int(width * self._rng.uniform(0.3, 0.55)), int(height * 0.86)
        self._box(x, top, width - x, 16, (112, 140, 164))
        self._box(x + 30, top + 16, 16, height - top, (90, 92, 96))
        for screen in range(2):
            left = x + 60 + screen * 190
            self._box(left, top - 110, 160, 96, (44, 42, 42))
            self._box(left + 7, top - 103, 146, 80, (96, 78, 62))
            self._box(left + 68, top - 14, 24, 14, (50, 48, 48))
        self._box(x + 440, top - 34, 60, 34, self._pick(_THINGS))

    def _place(self, width_share: float, top_share: float, height_share: float) -> tuple[int, int, int, int]:
        """Return x, y, w, h of the next thing along the wall, and move the cursor behind it."""
        height, width = self.image.shape[:2]
        x, w = min(self._x, width - 20), int(width * width_share * self._rng.uniform(0.85, 1.1))
        self._x += w + int(width * self._rng.uniform(0.01, 0.05))
        y = int(height * top_share * self._rng.uniform(0.7, 1.3))
        return x, y, min(w, width - x), int(height * height_share)

    def _box(self, x: int, y: int, w: int, h: int, bgr: Bgr) -> None:
        shade = int(self._rng.integers(-6, 7))
        b, g, r = (max(0, min(255, value + shade)) for value in bgr)
        cv2.rectangle(self.image, (x, y), (x + w, y + h), (b, g, r), cv2.FILLED)
        cv2.rectangle(self.image, (x, y), (x + w, y + h), (b * 0.7, g * 0.7, r * 0.7), 1)

    def _scribble(self, x: int, y: int, length: int) -> None:
        """Write something nobody can read."""
        if length < 20:
            return
        steps = np.arange(0, length, 5)
        heights = y + self._rng.integers(-7, 8, len(steps))
        gaps = self._rng.random(len(steps)) < 0.15
        ink = self._pick(_INKS)
        for word in np.split(np.column_stack((x + steps, heights)), np.flatnonzero(gaps)):
            cv2.polylines(self.image, [word.astype(np.int32)], False, ink, 2, cv2.LINE_AA)

    def _pick(self, colours: tuple[Bgr, ...]) -> Bgr:
        return colours[int(self._rng.integers(len(colours)))]
