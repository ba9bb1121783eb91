"""One camera's memory of the room behind the vehicle, and whether it still sees it where it was.

    choose patches, away from the balls -> look up a few of them each round -> after each has had its turn, one Shift
    -> beyond doubt in passes one after the other: moved

No hand, no vehicle and no change of light moves most of a room at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracker.camera import Camera
from tracker.health.patch import Motion, Patch, choose_patches
from tracker.health.shift import LEAST_PATCHES, Shift, find_shift
from tracker.standing import Witness
from tracker.types import Array, Image

PASS_NS, HURRIED_NS = 4_000_000_000, 700_000_000  # in which each patch has its turn; the second on suspicion
LIMIT_PX, SIGMAS = 0.25, 4.0  # a picture that has moved further beyond doubt is no longer that of the calibration
NEAR_ENOUGH_PX = 1.0  # patches that moved less are found from where they were
PASSES = 2  # one after the other that say so
NEVER_NS = 2**63
NOTHING_PX: Array = np.zeros((0, 2))


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What the last pass saw. shift: None where the patches agree on none.  largest_px: how far any pixel moved."""

    shift: Shift | None
    largest_px: float
    certain: bool


class Background:
    """Watch the room through one camera, a patch now and then.

    camera: its picture's size.
    ahead: of the time from patch to patch, by what share the first is behind its time: that of each camera of a rig
        differs, so that they look in different rounds, and none is held up by all of them.
    """

    def __init__(self, camera: Camera, ahead: float = 0.0) -> None:
        self._ahead = ahead
        width, height = camera.width_px - 1, camera.height_px - 1
        self._middle_px = np.array([width, height]) / 2.0
        self._corners_px = np.array([[0, 0], [width, 0], [0, height], [width, height]]) - self._middle_px
        self._patches: tuple[Patch, ...] | None = None
        self._far = False
        self._expected: Shift | None = None
        self._moved: list[Motion | None] = []
        self._begun_ns = 0
        self._pass_ns = PASS_NS
        self._alarming = 0
        self.newest: Seen | None = None
        self.witness = Witness.LEARNING

    @property
    def chosen(self) -> bool:
        """Say whether it is settled what to look for."""
        return self._patches is not None

    @property
    def due_ns(self) -> int:
        """Return when the next patch is to be looked up [ns]."""
        if self._patches is None:
            return self._begun_ns
        if len(self._patches) < LEAST_PATCHES:
            return NEVER_NS
        return self._begun_ns + len(self._moved) * self._pass_ns // len(self._patches)

    @property
    def shift(self) -> Shift | None:
        """Return the picture's motion since the beginning as last seen, None where it is not known."""
        return None if self.newest is None else self.newest.shift

    def hurry(self) -> None:
        """End this pass sooner: something else speaks against the camera."""
        self._pass_ns = HURRIED_NS

    def look(self, image: Image, t_ns: int, balls_px: Array = NOTHING_PX, off_px: float = 0.0) -> bool:
        """Look up the patches that are due in an image taken at t_ns [ns]; say whether that ended a pass.

        Args:
            balls_px: (n, 2) where the balls are.  off_px: the vehicle reaches so far around them.
        """
        if self._patches is None:
            self._patches = choose_patches(image, balls_px, off_px)
            self._begin(t_ns - round(self._ahead * PASS_NS / max(len(self._patches), 1)))
            if len(self._patches) < LEAST_PATCHES:
                self.witness = Witness.BLIND
            return True
        if len(self._patches) < LEAST_PATCHES:
            return False
        if t_ns < self._begun_ns:
            self._begin(t_ns)  # the clock was set back
        if t_ns < self.due_ns:
            return False
        self._moved.append(self._find(self._patches[len(self._moved)], image))
        if len(self._moved) < len(self._patches):
            return False
        self._judge()
        self._begin(t_ns)
        return True

    def _find(self, patch: Patch, image: Image) -> Motion | None:
        """Look a patch up: where the last pass says, or far about."""
        if self._far:
            return patch.searched(image)
        u, v = 0.0, 0.0
        if self._expected is not None:
            u, v = self._expected.at(np.array([[patch.u_px, patch.v_px]]) - self._middle_px)[0].tolist()
        return patch.followed(image, (u, v))

    def _begin(self, t_ns: int) -> None:
        self._moved.clear()
        self._begun_ns = t_ns

    def _judge(self) -> None:
        """Draw the conclusion of a pass; look farther next time where most patches are not where they were."""
        found = [(patch, moved) for patch, moved in zip(self._patches or (), self._moved, strict=True) if moved]
        shift = None
        if len(found) >= LEAST_PATCHES:
            xy_px = np.array([(patch.u_px, patch.v_px) for patch, _ in found]) - self._middle_px
            sigma_px = np.array([patch.sigma_px for patch, _ in found])
            shift = find_shift(xy_px, np.array([moved for _, moved in found]), sigma_px)
        self.newest = self._seen(shift)
        self._far = not self._far and shift is None
        self._expected = shift if self.newest.largest_px > NEAR_ENOUGH_PX else None
        self._alarming = self._alarming + 1 if self.newest.certain else 0
        self._pass_ns = HURRIED_NS if self._far or 0 < self._alarming < PASSES else PASS_NS
        self.witness = self._verdict(self.newest)

    def _seen(self, shift: Shift | None) -> Seen:
        if shift is None:
            return Seen(None, 0.0, certain=False)
        moved_px, sigma_px = shift.at(self._corners_px), shift.sigmas_at(self._corners_px)
        far_px = np.hypot(moved_px[:, 0], moved_px[:, 1])
        return Seen(shift, float(far_px.max()), certain=bool((far_px - SIGMAS * sigma_px > LIMIT_PX).any()))

    def _verdict(self, seen: Seen) -> Witness:
        if seen.shift is None:
            return Witness.BLIND
        if self._alarming >= PASSES:
            return Witness.MOVED
        return self.witness if seen.certain else Witness.STILL
