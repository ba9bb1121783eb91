"""Look at the images of one instant round a predicted state, and update it by the balls found in them."""

from __future__ import annotations

import math
from collections.abc import Callable

from tracker.filter.ekf import Update, update
from tracker.filter.predict import Prediction
from tracker.filter.witness import Quarrel, doubted_alone, too_lonely, unforeseen
from tracker.harvest import Harvest
from tracker.image.eyes import Eyes
from tracker.image.look import Look
from tracker.image.view import reach_m
from tracker.rig import Rig
from tracker.state import R_ZZ, State
from tracker.tuning import Tuning
from tracker.types import BallSighting, Frame, Reason, Rejected

Round = tuple[Frame, ...]


class Study:
    """Find the balls where a state expects them, update it, and learn how they look.

    stopwatch: reads a running time [ns], for the stage times.
    """

    def __init__(self, rig: Rig, tuning: Tuning, eyes: Eyes, stopwatch: Callable[[], int]) -> None:
        self._rig = rig
        self._tuning = tuning
        self._eyes = eyes
        self._quarrel = Quarrel()
        self._stopwatch = stopwatch

    def stand(self, rig: Rig) -> None:
        """Take the cameras to stand elsewhere."""
        self._rig = rig
        self._eyes.stand(rig)

    def __call__(self, frames: Round, ahead: Prediction, harvest: Harvest, last: State | None) -> Update | None:
        """Look, update and learn, and go over the same images again as long as it is hardly known how balls look.

        Args:
            frames: of one instant.  ahead: a state carried to it, or a first guess.  harvest: added to.
            last: the state before; None for a first guess, which every ball must bear out in two cameras.
        Returns:
            The update, or None when nothing fits.
        """
        found = self._see(frames, ahead, harvest, last)
        for _ in range(self._eyes.lessons_due(found.used) if found is not None else 0):
            found = self._see(frames, ahead, Harvest(), last) or found
        return found

    def update(self, ahead: Prediction, sightings: tuple[BallSighting, ...]) -> Update | Rejected:
        """Update a predicted state, unless it comes to lean as no vehicle does."""
        result = update(ahead, sightings, self._rig, self._tuning.gate_probability)
        if isinstance(result, Update) and (tilt := _tilt_rad(result.state)) > self._tuning.tilt_limit_rad:
            limit_deg = math.degrees(self._tuning.tilt_limit_rad)
            detail = f"the pose leans {math.degrees(tilt):.0f} deg, limit {limit_deg:.0f} deg: mirrored or mistaken"
            return Rejected(Reason.GEOMETRY, detail, ahead.state.t_ns)
        return result

    def _see(self, frames: Round, ahead: Prediction, harvest: Harvest, last: State | None) -> Update | None:
        """Look where a predicted state expects the balls and update it, or return None."""
        found, look = self._glance(frames, ahead, ahead.state, harvest, last)
        if isinstance(found, Update) and last is not None and look.blind:
            # Only now is known how fast the balls move, and so how their images are smeared: look again.
            again, sharper = self._glance(frames, ahead, found.state, harvest, last)
            found, look = (again, sharper) if isinstance(again, Update) else (found, look)
        harvest.rejections += look.rejections
        taught = look.sightings
        if isinstance(found, Rejected):
            harvest.rejections.append(found)
            harvest.refused += look.sightings
            return None
        harvest.sightings += found.used
        harvest.rejections += found.rejected
        blindly = self._eyes.blind(found.state)
        if len(found.used) < len(taught):
            used = {(sighting.camera, sighting.ball) for sighting in found.used}
            taught = [one for one in look.sightings if (one.camera, one.ball) in used]
            harvest.refused += [one for one in look.sightings if (one.camera, one.ball) not in used]
        self._eyes.learn(look, taught, found.state, blindly=blindly)
        self._eyes.look_behind(frames, found.state)
        return found

    def _glance(
        self, frames: Round, ahead: Prediction, expected: State, harvest: Harvest, last: State | None
    ) -> tuple[Update | Rejected, Look]:
        """Look where a state expects the balls, and update the prediction by them."""
        started_ns = self._stopwatch()
        look = self._eyes.look(frames, expected)
        looked_ns = self._stopwatch()
        sightings = doubted_alone(look.sightings, last)
        found = self.update(ahead, sightings)
        harvest.find_ns += looked_ns - started_ns
        harvest.filter_ns += self._stopwatch() - looked_ns
        looking = (frame.camera for frame in frames)
        if isinstance(found, Update) and too_lonely(found.used, looking, len(self._rig.marker)):
            fitting = ", ".join(f"ball {one.ball} in camera {one.camera}" for one in found.used)
            detail = f"all that bears a pose out in {len(frames)} pictures: {fitting}"
            found = Rejected(Reason.ALONE, detail, ahead.state.t_ns)
        if isinstance(found, Update) and last is not None and self._unforeseen(found, ahead):
            detail = f"{len(found.used)} sightings make a pose, but it was not known where to look for them"
            found = Rejected(Reason.FRAME_GATE, detail, ahead.state.t_ns)
        if isinstance(found, Update) and self._quarrel.is_new(sightings, found.used):
            detail = "two cameras contradict each other, and neither is believed yet"
            found = Rejected(Reason.FRAME_GATE, detail, ahead.state.t_ns)
        if isinstance(found, Update) and last is None and not self._all_seen_twice(found):
            found = Rejected(Reason.GEOMETRY, "not every ball fits in two cameras", ahead.state.t_ns)
        return found, look

    def _unforeseen(self, found: Update, ahead: Prediction) -> bool:
        """Say whether an update rests on few sightings of which the track could not say where they would be."""
        P_ahead = ahead.state.P if found.P_ahead is None else found.P_ahead
        return unforeseen(found.used, len(self._rig.marker), ahead.dt, P_ahead, reach_m(self._rig))

    def _all_seen_twice(self, found: Update) -> bool:
        """Say whether a start is borne out by every ball in two cameras: less fits many places."""
        cameras = [{s.camera for s in found.used if s.ball == ball} for ball in range(len(self._rig.marker))]
        return all(len(seen) >= 2 for seen in cameras)


def _tilt_rad(state: State) -> float:
    """Return the angle between the body's z and the room's [rad]."""
    return math.acos(max(-1.0, min(1.0, state.mean.item(R_ZZ))))
