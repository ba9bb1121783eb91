"""Look for the camera poses that know the vehicle's pose best.

First an exchange among poses on a grid, all looking at the volume's middle, as optimal designs are found: information
adds up, so a camera is weighed against the rest without looking again. Then each camera in turn is moved and turned
freely.
Source: V. V. Fedorov, "Theory of Optimal Experiments" (1972), the exchange; J. A. Nelder, R. Mead, "A simplex method
    for function minimization", Computer Journal 7 (1965), the rest, by scipy.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from tools.place.limits import Limits
from tracker.errors import OperatorError
from tracker.maths import so3
from tracker.placement.forecast import CAMERAS_NEEDED, ball_error, covariance_of, lever
from tracker.placement.mount import Stand, aimed
from tracker.placement.views import View, look, poses_of
from tracker.types import Array, frozen_array

STARTS, REFINED, ROUNDS = 6, 2, 2
MOST_CANDIDATES = 400
STEPS = 4  # along the volume's longest side
UNCOVERED_M = 0.1
"""What a share of uncovered poses costs beside the error: 1 % as much as 1 mm."""
UNKNOWN_M = 0.01
"""A larger error counts as this one: where the volume cannot be covered, its share must decide."""
AIM_STEP = math.radians(4.0)


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Poses a camera might take, with what it would see from there: pictured (c, s, n), information (c, s, 6, 6)."""

    stands: list[Stand]
    pictured: Array
    information: Array
    places: Array


class Search:
    """One room's search. Its cost is half the mean and half the worst point's error of the balls' places, in metres,
    and UNCOVERED_M times the share of poses that two cameras do not have in the picture."""

    def __init__(self, limits: Limits, tell: Callable[[str], None]) -> None:
        self._limits = limits
        self._tell = tell
        extent = limits.volume.high - limits.volume.low
        self._poses = poses_of(limits.volume.points(float(extent.max()) / STEPS), _few_attitudes(limits.tilt_rad))
        self._lever = lever(limits.marker, self._poses)
        self._boxes = {box.name: box for box in limits.mounts}

    def best(self, count: int, seed: int) -> list[Stand]:
        """Return the best cameras found.

        Raises:
            OperatorError: no place from which anything of the volume is seen, or too few apart from each other.
        """
        candidates = self._candidates()
        rng = np.random.default_rng(seed)
        found = sorted((self._exchange(candidates, count, rng) for _ in range(STARTS)), key=lambda outcome: outcome[0])
        unlike = [outcome for k, outcome in enumerate(found) if outcome[1] not in [o[1] for o in found[:k]]]
        refined = []
        for k, (cost, chosen) in enumerate(unlike[:REFINED]):
            better = self._refine([candidates.stands[c] for c in chosen])
            refined.append(better)
            self._tell(f"start {k + 1}: {1e3 * cost:.3f} mm on the grid, {1e3 * better[0]:.3f} mm moved freely")
        return min(refined, key=lambda outcome: outcome[0])[1]

    def cost(self, information: Array, pictured: Array) -> Array:
        """Return the cost (...) of information (..., s, 6, 6) and counts of cameras that picture a ball (..., s, n)."""
        error = np.minimum(ball_error(covariance_of(information), self._lever), UNKNOWN_M)
        by_point = np.sqrt((error.reshape(*error.shape[:-1], self._poses.points, -1) ** 2).mean(axis=-1))
        uncovered = 1.0 - (pictured >= CAMERAS_NEEDED).all(axis=-1).mean(axis=-1)
        return np.asarray(0.5 * error.mean(axis=-1) + 0.5 * by_point.max(axis=-1) + UNCOVERED_M * uncovered)

    def view(self, stand: Stand) -> View:
        """Look from a stand at the poses of the search."""
        return look(stand.camera("cam"), self._limits.marker, self._poses, self._limits.sharpness)

    def _candidates(self) -> Candidates:
        limits = self._limits
        spacing_m = 0.5
        while sum(len(box.points(spacing_m)) for box in limits.mounts) * len(limits.lenses) > MOST_CANDIDATES:
            spacing_m *= 1.15
        stands = [
            aimed(box.name, place, limits.volume.centre, lens)
            for box in limits.mounts
            for place in box.points(spacing_m)
            for lens in limits.lenses
            if not limits.volume.holds(place)
        ]
        views = [self.view(stand) for stand in stands]
        kept = [k for k, view in enumerate(views) if view.pictured.any()]
        if not kept:
            raise OperatorError(
                f"place: from none of {len(stands)} places does a camera have a whole marker ball of "
                f"{limits.sharpness.least_radius_px:g} px radius or more in its picture; choose longer lenses, nearer "
                "mounts or more pixels"
            )
        return Candidates(
            [stands[k] for k in kept],
            np.stack([views[k].pictured for k in kept]).astype(np.float64),
            np.stack([views[k].information for k in kept]),
            np.stack([stands[k].p_CinW for k in kept]),
        )

    def _exchange(self, candidates: Candidates, count: int, rng: np.random.Generator) -> tuple[float, list[int]]:
        """Replace one camera at a time by the best candidate until none is better."""
        chosen = rng.integers(len(candidates.stands), size=count).tolist()
        cost, before = math.inf, math.inf
        for _ in range(20):
            for k in range(count):
                others = chosen[:k] + chosen[k + 1 :]
                costs = self.cost(
                    candidates.information + candidates.information[others].sum(axis=0),
                    candidates.pictured + candidates.pictured[others].sum(axis=0),
                )
                costs[self._crowded(candidates.places, candidates.places[others])] = math.inf
                chosen[k] = int(np.argmin(costs))
                cost = float(costs[chosen[k]])
            if not cost < before - 1e-9:
                break
            before = cost
        if not math.isfinite(cost):
            raise OperatorError(
                f"place: {count} cameras find no places {self._limits.apart_m:g} m apart from each other; "
                "allow more mounts, or a smaller [place] apart_m"
            )
        return cost, sorted(chosen)

    def _crowded(self, places: Array, others: Array) -> Array:
        """Say which places (c, 3) are too near one of the others (k, 3)."""
        apart = np.linalg.norm(places[:, None] - others[None], axis=2)
        return np.asarray((apart < self._limits.apart_m).any(axis=1))

    def _refine(self, stands: list[Stand]) -> tuple[float, list[Stand]]:
        """Move and turn each camera in turn, the rest standing, a few times round."""
        stands, views = list(stands), [self.view(stand) for stand in stands]
        cost = math.inf
        for _ in range(ROUNDS):
            for k, stand in enumerate(stands):
                rest = [view for j, view in enumerate(views) if j != k]
                information = np.asarray(np.sum([view.information for view in rest], axis=0))
                pictured = np.asarray(np.sum([view.pictured for view in rest], axis=0, dtype=np.float64))
                others = np.stack([each.p_CinW for j, each in enumerate(stands) if j != k])
                cost, stands[k] = self._move(stand, information, pictured, others)
                views[k] = self.view(stands[k])
        return cost, stands

    def _move(self, stand: Stand, information: Array, pictured: Array, others: Array) -> tuple[float, Stand]:
        """Return the cost with the best stand near `stand` on its mount, and that stand."""
        box = self._boxes[stand.mount]
        wide = box.high > box.low
        share = np.where(wide, (stand.p_CinW - box.low) / np.where(wide, box.high - box.low, 1.0), 0.0)

        def placed(x: Array) -> Stand:
            shares = share.copy()
            shares[wide] = x[:-2]
            return replace(
                stand,
                p_CinW=frozen_array(box.at(shares)),
                azimuth=stand.azimuth + float(x[-2]) * AIM_STEP,
                tilt=min(max(stand.tilt + float(x[-1]) * AIM_STEP, -math.pi / 2.0), math.pi / 2.0),
            )

        def cost(x: Array) -> float:
            trial = placed(x)
            if self._crowded(trial.p_CinW[None], others)[0] or self._limits.volume.holds(trial.p_CinW):
                return 1.0 + UNCOVERED_M
            view = self.view(trial)
            return float(self.cost(information + view.information, pictured + view.pictured))

        start = np.append(share[wide], (0.0, 0.0))
        simplex = _simplex(start, np.append(np.full(int(wide.sum()), 0.15), (1.0, 1.0)))
        bounds = [(0.0, 1.0)] * int(wide.sum()) + [(-10.0, 10.0)] * 2
        done = minimize(
            cost, start, method="Nelder-Mead", bounds=bounds,
            options={"initial_simplex": simplex, "maxfev": 150, "xatol": 2e-3, "fatol": 1e-7},
        )  # fmt: skip
        best = done.x if done.fun < cost(start) else start
        return cost(best), placed(best)


def _few_attitudes(tilt_rad: float) -> list[Array]:
    """Return six headings, leaning to as many sides."""
    turns = np.arange(6) * math.pi / 3.0
    return [so3.from_euler(tilt_rad * math.cos(2.5 * t), tilt_rad * math.sin(2.5 * t), t) for t in turns.tolist()]


def _simplex(start: Array, steps: Array) -> Array:
    """Return the corners (n + 1, n) to begin with; a share steps away from the end it is near."""
    corners = np.tile(start, (len(start) + 1, 1))
    for k, step in enumerate(steps):
        corners[k + 1, k] += step if start[k] <= 0.5 else -step
    return corners
