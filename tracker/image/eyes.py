"""The cameras' eyes: they look for balls as they know them, and learn from those that were found."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tracker.image.album import Album
from tracker.image.appearance import MISFIT_MAX, Appearance
from tracker.image.behind import Behind, Room
from tracker.image.clarity import Clarity
from tracker.image.exposure import overexposed
from tracker.image.hiding import never_seen, remember
from tracker.image.look import Gaze, Look, gaze_of, look_near
from tracker.image.middle import Middle
from tracker.image.mounting import Mounting
from tracker.image.rivals import Rivals, first_rivals
from tracker.image.sight import MISFIT, SHOWN
from tracker.image.surprise import Surprise
from tracker.image.tint import NEUTRAL, Gains, Tint, core_colour
from tracker.image.view import RADIUS, unknown_streak_px, whereabouts
from tracker.rig import Rig
from tracker.state import State
from tracker.types import Array, BallSighting, Frame

LIGHT_BALLS = 2  # a single ball that is something else would tell of a light that is not there
LEARN_ALL = 108  # balls of each camera under its gamma; then
LEARN_EVERY, LEARN_SOON = 11, 5  # rounds one ball: odd, for free-running cameras have rounds in turn
AWAY_ROUNDS = 60  # a camera that saw no ball for so long learns when it sees some again
NOWHERE = np.full(3, np.inf)
BLIND_PX = 0.5  # of the streak's sigma: how fast the balls move is not known
SMEAR_DOUBT = 0.1  # of an unknown smear: what it moves the centre of a shaded ball, one sigma
SMEARED = 0.5  # radii: a ball smeared further leaves something at the ends of its streak
PLACE_STEP_M = 0.1  # of the vehicle: closer together, balls look alike in any light
LONG_STREAK_PX = 0.7  # an image smeared further than this, taken for a still one, teaches wrong


class Eyes:
    """What each camera of a rig knows of how balls look to it.

    doubts_px: (cameras,) by how much all centres may be wrong together for what is not known, one sigma [px].
    exposure_s: how long the slowest shutter stands open, as learned [s].
    """

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._rivals = [first_rivals() for _ in rig.cameras]
        self._albums = [Album(camera) for camera in rig.cameras]
        self._behind = [Behind(camera) for camera in rig.cameras]
        self._tints = [Tint() for _ in rig.cameras]
        self._proven = [NEUTRAL for _ in rig.cameras]  # the light in which all balls were seen last
        self._mounting = Mounting(rig.marker)
        self._surprise, self._clarity = Surprise(len(rig.cameras)), Clarity(len(rig.cameras))
        self._gazes = [
            gaze_of(rig, Appearance(), album, room=behind.room)
            for album, behind in zip(self._albums, self._behind, strict=True)
        ]
        self._first_gazes = [  # with templates of their own, so that those of balls as they are known stay
            gaze_of(rig, Appearance(), Album(camera), room=behind.room)
            for camera, behind in zip(rig.cameras, self._behind, strict=True)
        ]
        self._middle = Middle()
        self._place_m = NOWHERE  # from there, where balls look as is known now
        self._turn = 0
        self._noted_ns = -1
        self._seen_at = [0] * len(rig.cameras)  # in which turn each saw a ball
        self._taught_blindly = False
        self._sum_up()

    def _sum_up(self) -> None:
        """Take note of what is known by now: asked for in every round, it changes with lessons alone."""
        appearances = [rivals.best for rivals in self._rivals]
        for index, appearance in enumerate(appearances):
            if self._gazes[index].appearance is not appearance:
                self._gazes[index] = self._gazes[index].at_such(appearance)
        self._by_place = any(appearance.light.room.differs for appearance in appearances)
        self._exposures_s = tuple([appearance.response.exposure_s for appearance in appearances])
        self.exposure_s = max(self._exposures_s)
        self._lessons_due = max(rivals.lessons_due for rivals in self._rivals)
        self.doubts_px = np.hypot([rivals.doubt_px for rivals in self._rivals], self._clarity.light_px)
        awake = [each for each, at in zip(self._rivals, self._seen_at, strict=True) if self._turn - at <= AWAY_ROUNDS]
        self._gamma_known = all(rivals.settled or rivals.by_room for rivals in awake)  # if not for the last time
        enough = all(rivals.count >= LEARN_ALL or rivals.has_seen(LEARN_ALL) for rivals in awake)
        self._settled = self._gamma_known and enough  # how balls look is known, so that little is left to learn
        self._every = LEARN_EVERY if all(rivals.settled for rivals in awake) else 1

    def lessons_due(self, seen: Sequence[BallSighting]) -> int:
        """Return how often images should be gone over again, since nothing else is known yet to cameras that saw."""
        return max(self._rivals[one.camera].lessons_due for one in seen) if self._lessons_due else 0

    def stand(self, rig: Rig) -> None:
        """Take the cameras to stand elsewhere."""
        for before, now, behind in zip(self._rig.cameras, rig.cameras, self._behind, strict=True):
            if now is not before:
                behind.forget()
        self._rig = rig

    @property
    def gains(self) -> tuple[Gains, ...]:
        """Return the colour of the light in each camera."""
        return tuple([tint.gains for tint in self._tints])

    def other_gains(self, number: int) -> tuple[Gains, ...]:
        """Return another light to look for balls under, for each camera; numbers go round, the nearest first."""
        return tuple(tint.other(number) for tint in self._tints)

    def suppose(self, gains: Sequence[Gains]) -> None:
        """Take the light in each camera to be so."""
        for index, one in enumerate(gains):
            self._light_up(index, self._tints[index]._replace(gains=one))

    def _light_up(self, index: int, tint: Tint) -> None:
        """Take the light in one camera to be so; the colours looked for change in few, large steps."""
        self._tints[index], gaze = tint, self._gazes[index]
        if tint.gains.undoing != gaze.undoing:
            self._gazes[index] = gaze.in_light(self._rig, tint.gains)

    def look(self, frames: Sequence[Frame], state: State) -> Look:
        """Find each ball in each image where a state expects it."""
        self._go_along(state)
        whose = self._may_draw(frames)
        for index, album in enumerate(self._albums):
            album.draws_left = int(index == whose) if self._settled else None
        look = look_near(frames, self._rig, state, self._gazes, self._mounting.things)
        self._look_again(frames, state, look)
        smear_px = self._smear_px(state)
        look.blind = smear_px > BLIND_PX
        return look.doubted(SMEAR_DOUBT * smear_px) if look.blind else look

    def _go_along(self, state: State) -> None:
        """Take balls to look as they do where the vehicle is: lamps that hang near light it from other sides there."""
        if not (self._by_place and self._middle.is_known):
            return
        place_m = self._middle.place(state.p_BinW)
        if not math.dist(place_m, self._place_m) <= PLACE_STEP_M:
            self._place_m = place_m
            before, self._rivals = self._rivals, [rivals.at(place_m) for rivals in self._rivals]
            if any(now is not then for now, then in zip(self._rivals, before, strict=True)):
                self._sum_up()

    def _look_again(self, frames: Sequence[Frame], state: State, look: Look) -> None:
        """Look at images without a ball in the light in which their camera last saw all, or as if nothing were known.

        What is before balls for a moment may be taken for another light, or teach one, in which no ball is seen any
        more. All balls must be there: fewer might be anything of their colours.
        """
        seen = [sighting.camera for sighting in look.sightings]
        for frame in frames:
            index, count = frame.camera, seen.count(frame.camera)
            if count == len(self._rig.marker):
                self._proven[index] = self._tints[index].gains
            elif count == 0:
                gains = self._proven[index]
                proven = self._gazes[index].in_light(self._rig, gains)
                if gains.undoing != self._gazes[index].undoing and self._sees_all(frame, state, proven, look):
                    self._light_up(index, self._tints[index]._replace(gains=gains))
                elif self._sees_all(frame, state, self._first_gazes[index], look):
                    self._light_up(index, Tint())
                    self._rivals[index] = first_rivals()
                    self._sum_up()

    def _sees_all(self, frame: Frame, state: State, gaze: Gaze, look: Look) -> bool:
        """Say whether an image shows all balls to such a gaze, and take over what it gave if so."""
        again = look_near([frame], self._rig, state, {frame.camera: gaze}, self._mounting.things)
        found = len(again.sightings) == len(self._rig.marker)
        if found:
            look.replace(again)
        return found

    def _may_draw(self, frames: Sequence[Frame]) -> int | None:
        """Return the camera that may draw a template: each that sees now in turn, and none in a lesson's round."""
        lessons, since = divmod(self._turn + 1, LEARN_EVERY)
        return frames[(self._turn - lessons) % len(frames)].camera if since else None

    def blind(self, state: State) -> bool:
        """Say whether a state does not know how far the balls' images are smeared."""
        return self._smear_px(state) > BLIND_PX

    def _smear_px(self, state: State) -> float:
        """Return one sigma of how far the balls' images may be smeared that the state does not know of [px]."""
        return unknown_streak_px(state, self._rig, self._exposures_s)

    def learn(self, look: Look, seen: Sequence[BallSighting], state: State, *, blindly: bool) -> None:
        """Learn how balls look: from every one at first, then from one in turn every few rounds.

        seen: sightings of the look that fitted.  state: of about their time.
        blindly: how fast they moved was not known. It is better than nothing, and forgotten if they did move.
        """
        self._turn += 1
        self._take_note(look, seen, blindly=blindly)
        if self._taught_blindly and not blindly:
            self._taught_blindly = False
            if any(look.fitted(one).streak_px > LONG_STREAK_PX for one in seen):
                self._begin_anew([first_rivals() for _ in self._rig.cameras])
        self._taught_blindly |= blindly and not self._gamma_known
        teachers = seen
        if self._settled:
            every = min(self._every, LEARN_SOON) if self._surprise.is_some else self._every
            if self._turn % every:
                return
            teachers = [seen[self._turn // every % len(seen)]]
        self._clarity.take(seen, state, self._rig)
        place_m = self._placed(state)
        for sighting in teachers:
            one, index = look.fitted(sighting), sighting.camera
            camera, image = self._rig.cameras[index], one.frame.image
            expected = one.expected(camera, self._behind[index].room)
            if overexposed(image, *expected.uv_px, expected.radius_px):
                continue
            others = [rivals for other, rivals in enumerate(self._rivals) if other != index]
            self._rivals[index] = self._rivals[index].learned(image, camera, expected, one.centre, others, place_m)
            if one.streak_px < SMEARED * expected.radius_px:
                self._mounting.learn(image, expected, one.sighting.ball, one.centre, camera.R_CtoW.T @ state.R_BtoW)
        self._sum_up()

    def _placed(self, state: State) -> Array:
        """Return where the vehicle teaches from the room's middle (3,) [m], which moves on with it."""
        shift_m = self._middle.moved(state.p_BinW)
        if shift_m is not None:
            self._place_m = self._place_m - shift_m
            self._rivals = [rivals.recentred(shift_m) for rivals in self._rivals]
        return self._middle.place(state.p_BinW)

    def _take_note(self, look: Look, seen: Sequence[BallSighting], *, blindly: bool) -> None:
        """Note what shows with every look: how much of each ball, the light's colour, and whether all fit as before."""
        newest_ns = max([glance.frame.t_ns for glance in look.glances.values()])
        again, self._noted_ns = newest_ns == self._noted_ns, newest_ns
        for one in seen:
            self._seen_at[one.camera] = self._turn
        for index, glance in look.glances.items() if not again else ():
            remember(glance.fits[:, SHOWN], self._gazes[index].lately)
        self._follow_the_light(look, seen)
        if self._settled and not (again or blindly):
            self._notice_other_light(look, seen)

    def _notice_other_light(self, look: Look, seen: Sequence[BallSighting]) -> None:
        """Begin the light anew once all balls fit so much worse than before that it must fall otherwise now."""
        for camera, glance in look.glances.items():
            misfit_of = glance.fits.item
            self._surprise.take(camera, [misfit_of(one.ball, MISFIT) for one in seen if one.camera == camera])
        if self._surprise.is_great:
            self._begin_anew([rivals.in_other_light() for rivals in self._rivals])

    def _begin_anew(self, rivals: list[Rivals]) -> None:
        """Know no more of how balls look than some rivals do."""
        self._rivals, self._surprise = rivals, Surprise(len(rivals))
        self._middle, self._place_m = Middle(), NOWHERE
        for gaze in self._gazes:
            gaze.lately[:] = never_seen(len(gaze.lately))
        self._sum_up()

    def look_behind(self, frames: Sequence[Frame], state: State) -> None:
        """Learn the room where the vehicle is not, by frames of about a state's time; once it is known, by some."""
        for frame in frames:
            behind = self._behind[frame.camera]
            if not behind.is_due():
                continue
            u, v, clear_px = whereabouts(state, self._rig, frame.camera)
            if math.isfinite(u) and math.isfinite(v):
                behind.learn(frame, (u, v), clear_px)

    def room_behind(self, camera: int) -> Room:
        """Return what is known to stand behind in one camera's pictures, `NO_ROOM` for nothing."""
        return self._behind[camera].known

    def suppose_behind(self, frames: Sequence[Frame]) -> None:
        """Take for the room, as long as nothing better is known, what stays in frames without a track."""
        for frame in frames:
            self._behind[frame.camera].suppose(frame)

    def _follow_the_light(self, look: Look, seen: Sequence[BallSighting]) -> None:
        """Learn the light from the balls' colours: of each camera at first, then of those that see now in turn."""
        cameras = sorted({one.camera for one in seen})
        if cameras and all(self._tints[camera].settled for camera in cameras):
            cameras = [cameras[self._turn % len(cameras)]]
        for camera in cameras:
            frame, views, fits, *_ = look.glances[camera]
            found, colours = fits.tolist(), []
            for one in seen:
                u, v, misfit = found[one.ball][0], found[one.ball][1], found[one.ball][MISFIT]
                if one.camera == camera and misfit <= MISFIT_MAX:
                    colours.append((one.ball, core_colour(frame.image, u, v, views[one.ball][RADIUS])))
            if len(colours) >= LIGHT_BALLS:
                self._light_up(camera, self._tints[camera].learned(colours))
