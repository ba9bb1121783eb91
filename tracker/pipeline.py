"""The tracker, top to bottom: a camera's frame goes in, the vehicle's pose comes out.

    frame -> round of one instant -> look where the track expects the balls -> update the filter -> Estimate
                                  -> nothing there: look everywhere, triangulate, eq. 4-6, start again

It reads no clock but the stopwatch it is given, and touches no file and no device.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from tracker.attendance import Attendance
from tracker.cadence import Cadence
from tracker.departure import Departure
from tracker.exposed import Exposed
from tracker.filter.continuity import Continuity
from tracker.filter.ekf import Update
from tracker.filter.history import History
from tracker.filter.predict import Prediction, first_guess, predict
from tracker.harvest import Harvest
from tracker.health.background import LIMIT_PX
from tracker.health.mend import SHARE
from tracker.health.watch import CalibrationWatch
from tracker.image.eyes import Eyes
from tracker.image.tint import Gains
from tracker.intake import Intake
from tracker.rig import Rig
from tracker.rounds import Rounds
from tracker.standing import Health
from tracker.start.acquire import Seen, first_state, together
from tracker.start.whole import Whole, look_through, to_start_on
from tracker.state import OFFSETS, State
from tracker.study import Round, Study
from tracker.tuning import Tuning
from tracker.types import (
    Event,
    Frame,
    Reason,
    Rejected,
    Silence,
    Step,
    TrackState,
)

NO_BREAKS: Mapping[int, float] = MappingProxyType({})


class Tracker:
    """Follow one marker through the frames of two to eight cameras.

    rig: cameras and marker.  tuning: limits.  stopwatch: reads a running time [ns], for the stage times.
    """

    def __init__(self, rig: Rig, tuning: Tuning, stopwatch: Callable[[], int]) -> None:
        self._rig = rig
        self._tuning = tuning
        self._stopwatch = stopwatch
        self._intake = Intake(rig)
        self._rounds = Rounds(len(rig.cameras), tuning.sync_window_ns)
        self._eyes = Eyes(rig)
        self._study = Study(rig, tuning, self._eyes, stopwatch)
        self._history = History(tuning.lag_rounds)
        self._departure = Departure(tuning.lag_rounds, stopwatch)
        self._whole: dict[int, Whole] = {}
        self._track = TrackState.SEARCHING
        self._lights_tried = 0
        self._continuity = Continuity(tuning)
        self._cadence = Cadence(len(rig.cameras))
        self._watch = CalibrationWatch(rig, tuning.process.pixel_noise_px, tuning.calibrated_px)
        self._exposed = Exposed(rig)
        self._moved_px = np.zeros(len(rig.cameras))
        self._anew = False
        self._attendance = Attendance()

    def step(self, event: Event) -> Step:
        """Take one event of the source and return what came of it."""
        if isinstance(event, Frame) and 0 <= event.camera < len(self._rig.cameras):
            offset_ns = self._rig.cameras[event.camera].clock_offset_ns
            event = replace(event, t_ns=event.t_ns + offset_ns) if offset_ns else event
        if isinstance(event, Silence):
            self._intake.wait(event.t_ns)
        if isinstance(event, Rejected):
            return Step(self._track, rejections=(event,))
        refused = self._intake.refuse(event) if isinstance(event, Frame) else None
        rounds = self._rounds.take(event) if refused is None else []
        harvest = self._work_off(rounds) if rounds else None
        self._watch_the_time(event.t_ns)
        if self._track is TrackState.LOST and self._departure.is_awaited:
            harvest = harvest or Harvest(rejections=[] if refused is None else [refused])
            self._let_go(harvest, all_of_them=True)
        if harvest is None:
            return Step(self._track, rejections=() if refused is None else (refused,))
        return self._step(harvest)

    def finish(self) -> Step:
        """Work off the round that was still open when the frames ended, and let go what waits."""
        harvest = self._work_off(self._rounds.rest())
        self._let_go(harvest, all_of_them=True)
        return self._step(harvest)

    def _work_off(self, rounds: Sequence[Round]) -> Harvest:
        """Take rounds in their order and return what they gave."""
        harvest = Harvest()
        for frames in rounds:
            self._take_round(frames, harvest)
        return harvest

    def _step(self, harvest: Harvest) -> Step:
        return Step(
            self._track,
            tuple(harvest.sightings),
            tuple(harvest.rejections),
            tuple(harvest.estimates),
            tuple(harvest.refused),
            harvest.health,
        )

    def _take_round(self, frames: Round, harvest: Harvest) -> None:
        """Find the vehicle in a round, and see whether the cameras still stand where they did."""
        used_before, refused_before = len(harvest.sightings), len(harvest.refused)
        t_ns = max([frame.t_ns for frame in frames])
        self._locate(frames, t_ns, harvest)
        self._departure.passed(t_ns)
        self._let_go(harvest)
        state = self._history.newest if self._track is TrackState.TRACKING else None
        used, refused = harvest.sightings[used_before:], harvest.refused[refused_before:]
        health = self._watch.take(frames, used, refused, state, t_ns)
        if health is not None:
            if state is not None:
                self._exposed.look(frames, used, state)
            harvest.health = self._exposed.told(health)
            self._stand_by(health, harvest)

    def _stand_by(self, health: Health, harvest: Harvest) -> None:
        """Turn each camera that has moved, or moved on, to where the room shows that it looks, and trust it less."""
        for index, camera in enumerate(health.cameras):
            news_px = abs(SHARE * camera.shift_px - float(self._moved_px[index]))
            mended = self._watch.mended(index) if news_px > SHARE * LIMIT_PX else None
            if mended is not None:
                self._let_go(harvest, all_of_them=True)
                self._moved_px[index] = SHARE * camera.shift_px
                cameras = (*self._rig.cameras[:index], mended, *self._rig.cameras[index + 1 :])
                self._rig = replace(self._rig, cameras=cameras)
                self._study.stand(self._rig)
                self._history.doubt(index, SHARE * camera.shift_px)
                self._anew = True

    def _locate(self, frames: Round, t_ns: int, harvest: Harvest) -> None:
        """Follow the track through a round, the last of it of t_ns, or look for the marker in it; say where it is."""
        started_ns = self._stopwatch()
        harvest.find_ns = harvest.filter_ns = 0
        if self._history.forgot(t_ns):
            harvest.rejections += [_late(frame) for frame in frames]
            return
        before = self._history.newest
        known, self._anew = self._track is TrackState.TRACKING and not self._anew, False
        followed, tried = Harvest(), Harvest()
        found = self._follow(frames, t_ns, followed) if known else None
        if found is not None:
            self._attendance.take(found.used, [frame.camera for frame in frames])
            if self._attendance.hardly_any:
                found, self._track = None, TrackState.LOST
        if before is None or t_ns >= before.t_ns:
            few = found is None or 2 * len(found.used) < len(frames) * len(self._rig.marker)
            if few or self._attendance.fell_silent:  # what is seen may be something else: is the marker elsewhere?
                elsewhere = self._search(frames, t_ns, tried)
                if elsewhere is not None:
                    followed.sightings.clear()
                elif found is not None:
                    tried.rejections.clear()
                found = elsewhere or found
        harvest.add(followed)
        harvest.add(tried)
        if found is None or not self._departure.is_news(found.state.t_ns):
            return
        available_ns = max([frame.available_ns for frame in frames])
        stages = harvest.stages(started_ns - available_ns, self._stopwatch() - started_ns)
        self._continuity.went_out(found.state)
        resets = self._continuity.resets
        self._departure.take(found.state.t_ns, available_ns, self._track, resets, stages, self._eyes)

    def _let_go(self, harvest: Harvest, *, all_of_them: bool = False) -> None:
        """Let the poses out whose time it is, or all that wait."""
        harvest.estimates += self._departure.due(self._history, self._rig, self._moved_px, all_of_them=all_of_them)

    def _follow(self, frames: Round, t_ns: int, harvest: Harvest) -> Update | None:
        """Update the track with a round; a late one is put in where it belongs and what came after is done again."""
        later = self._history.back_to(t_ns)
        result = self._study(frames, self._ahead(t_ns, self._cadence.breaks(frames)), harvest, self._history.newest)
        if result is not None:
            self._history.remember(result)
        for past in later:
            again = self._study.update(self._ahead(past.t_ns), past.sightings)
            if isinstance(again, Rejected):
                harvest.rejections.append(again)
                continue
            self._history.remember(again)
            result = again
        return result

    def _ahead(self, t_ns: int, clock_breaks: Mapping[int, float] = NO_BREAKS) -> Prediction:
        """Return the newest state carried on to an instant; there is one while tracking.

        clock_breaks: by camera, how far its clock may have jumped meanwhile [s].
        """
        newest = self._history.newest
        if newest is None:
            raise ValueError("nothing is tracked yet")
        return predict(newest.with_clocks_open(clock_breaks) if clock_breaks else newest, t_ns, self._tuning.process)

    def _search(self, frames: Round, t_ns: int, harvest: Harvest) -> Update | None:
        """Look for the marker in whole frames, this round's and the other cameras' newest; start the track on it."""
        gains = self._eyes.gains
        for frame in frames:
            self._whole[frame.camera] = self._look_through(frame, gains)
        fresh = [w for w in self._whole.values() if t_ns - w.frame.t_ns <= self._tuning.coast_limit_ns // 2]
        found = self._start(to_start_on(fresh), harvest)
        if found is None and self._track is not TrackState.TRACKING:
            found = self._search_in_other_light(fresh)
            self._eyes.suppose_behind(frames if found is None else ())
        if found is None:
            return None
        if not self._continuity.believes(found.state):
            detail = "the marker has turned in place as no vehicle does: colours swapped"
            harvest.rejections.append(Rejected(Reason.GEOMETRY, detail, t_ns))
            self._eyes.suppose(gains)
            return None
        self._whole.clear()
        self._let_go(harvest, all_of_them=True)
        self._history.restart(found)
        self._track = TrackState.TRACKING
        return found

    def _look_through(self, frame: Frame, gains: Sequence[Gains]) -> Whole:
        camera = frame.camera
        room = self._eyes.room_behind(camera)
        return look_through(frame, self._rig.cameras[camera], self._rig, gains[camera], room)

    def _search_in_other_light(self, fresh: Sequence[Whole]) -> Update | None:
        """Look at the same frames as if the light had another colour, each time another one."""
        gains, others = self._eyes.gains, self._eyes.other_gains(self._lights_tried)
        self._lights_tried += 1
        self._eyes.suppose(others)
        found = self._start(to_start_on([self._look_through(one.frame, others) for one in fresh]), Harvest())
        if found is None:
            self._eyes.suppose(gains)
        return found

    def _start(self, attempts: Iterable[Seen], harvest: Harvest) -> Update | None:
        """Start on the marker in the first of some sets of blobs in which it is."""
        found, tried = None, Harvest()
        for seen in attempts:
            tried = Harvest()
            found = self._start_among(seen, tried)
            if found is not None:
                break
        harvest.add(tried)
        return found

    def _start_among(self, seen: Seen, harvest: Harvest) -> Update | None:
        """Start on the marker among blobs, if every ball's image bears it out."""
        start = first_state(seen, self._rig, self._tuning.process)
        if isinstance(start, Rejected):
            harvest.rejections.append(start)
            return None
        start, frames = self._still_known(start), tuple(frame for frame, _ in seen.values())
        if not together(frames):
            return self._study(frames, first_guess(start, self._tuning.process), harvest, None)
        # One instant tells no speed. Cameras that disagree must not be explained by a speed times a clock's offset.
        held = start.with_clocks(np.zeros_like(start.offsets_s), np.zeros_like(start.P[OFFSETS:, OFFSETS:]))
        found = self._study(frames, first_guess(held, self._tuning.process), harvest, None)
        if found is None:
            return None
        return found._replace(state=found.state.with_clocks(start.offsets_s, start.P[OFFSETS:, OFFSETS:]))

    def _still_known(self, start: State) -> State:
        """Return a first guess with what the last track learned of the cameras: their noise and their clocks."""
        last = self._history.newest
        if last is None:
            return start
        return replace(start, noise=last.noise).with_clocks(last.offsets_s, last.P[OFFSETS:, OFFSETS:])

    def _watch_the_time(self, t_ns: int) -> None:
        """Lose the track when nothing of it was seen for too long."""
        newest = self._history.newest
        if newest is not None and t_ns - newest.t_ns > self._tuning.coast_limit_ns:
            self._track = TrackState.LOST


def _late(frame: Frame) -> Rejected:
    return Rejected(Reason.LATE, "older than the filter remembers", frame.t_ns, frame.camera)
