"""How balls look to one camera, learned while tracking: the light that it sees and how it answers to it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from tracker.camera import Camera
from tracker.image.centre import Centre
from tracker.image.holder import without_holders
from tracker.image.lesson import light_on, sample_of, sharper
from tracker.image.light import MIDDLE, Light, ray_frame
from tracker.image.patch import Expected, Response, cut, detail_of, extent_of
from tracker.image.template import FLAT, Shades
from tracker.types import Array, Image

BEARING_STEP_RAD = 0.07  # rays closer than this share a ball's shading
PUBLISH_AT = (3, 6, 9, 12, 15, 18, 27)  # balls learned when templates follow the light; then, as long as
PUBLISH_SOON, MANY, PUBLISH_LATE = 9, 144, 36  # they are not many, every so many, and later every so many
LEAST_CHANGE = 0.02  # of many balls' light: one lamp's, it moves the centre of a 3 px ball by 0.01 px
KEPT = 8  # lights
BLUR_STEP_PX, FIRST_STEP_PX = 0.03, 0.15
DETAIL_SHARE = 0.05  # of the newest ball in what is known of the camera's colour detail
MISFIT_MAX = 2.0  # an image that fits no ball teaches nothing


@dataclass(frozen=True, slots=True, eq=False)
class Appearance:
    """What is known of one camera so far.

    response: the camera's.
    light: learned.  shown: the light that templates are drawn by; it follows `light` in few, growing steps, and once
        many balls were learned only where it has changed.
    earlier: lights shown before, the newest first: whoever comes back to a place finds the templates drawn there.
    """

    response: Response = field(default_factory=Response)
    light: Light = field(default_factory=Light)
    shown: Light = field(default_factory=Light)
    earlier: tuple[Light, ...] = ()

    def shades(self, camera: Camera, x: float, y: float) -> Shades:
        """Return how a ball is shaded that the camera sees along the ray (x, y, 1)."""
        if not self.shown.count:
            return FLAT
        return _shades(self.shown, camera, round(x / BEARING_STEP_RAD), round(y / BEARING_STEP_RAD))

    def with_gamma(self, gamma: float) -> Appearance:
        """Return it under another gamma, its light ready to be learned anew."""
        if gamma == self.response.gamma:
            return self
        power = gamma / self.response.gamma
        light, shown = self.light.taken_to(power), self.shown.taken_to(power)
        return replace(self, response=replace(self.response, gamma=gamma), light=light, shown=shown)

    def in_other_light(self) -> Appearance:
        """Return it with the light to be learned from nothing."""
        return Appearance(self.response)

    def expected_like(self, ball: Expected, camera: Camera, uv_px: Array) -> Expected:
        """Return what would be expected of a ball, seen at uv_px (2,), if it looked as is known here."""
        place = float(uv_px[0]), float(uv_px[1])
        shades = self.shades(camera, *_ray(ball, camera))
        return replace(ball, uv_px=place, shades=shades, response=self.response, drawn=None)

    def at(self, place_m: Array) -> Appearance:
        """Return it at a place (3,) from the room's middle in W [m]; the same where the light is hardly another."""
        light, shown = self.light, self.shown
        if not shown.count or (light.count > MANY and light.apart_at(place_m, shown) <= LEAST_CHANGE):
            return self
        return self._showing(light.at(place_m))

    def recentred(self, shift_m: Array) -> Appearance:
        """Return it about another middle of the room, shift_m (3,) from the one before in W."""
        return replace(self, light=self.light.recentred(shift_m))

    def learned(
        self,
        image: Image,
        camera: Camera,
        ball: Expected,
        found: Centre,
        others: Iterable[Light] = (),
        place_m: Array = MIDDLE,
    ) -> Appearance:
        """Return what is known after one more ball.

        Args:
            image: the camera's, BGR.
            ball, found: what was expected of the ball and what its fit gave.
            others: what other cameras learned of the room's light, asked for only when it is due.
            place_m: (3,) where the ball was, from the room's middle in W.
        """
        if found.misfit > MISFIT_MAX:
            return self
        extent = extent_of(ball)
        centre = float(found.uv_px[0]) - extent.u, float(found.uv_px[1]) - extent.v
        sample = sample_of(without_holders(cut(image, extent, ball), extent, ball), ball, centre)
        response = sharper(sample, max(BLUR_STEP_PX, FIRST_STEP_PX / (1.0 + self.light.count / 3.0)))
        detail = response.detail + DETAIL_SHARE * (detail_of(image, extent) - response.detail)
        response = replace(response, detail=detail)
        R_RtoW = ray_frame(*_ray(ball, camera), camera.R_CtoW)
        light = self.light.learned(*light_on(sample, self.light.lamp_seen(R_RtoW)), R_RtoW, place_m)
        if not (light.trusted and _due(light.count)):
            return replace(self, response=response, light=light)
        light = light.solved(others, place_m)
        return replace(self, response=response, light=light)._showing(light)

    def _showing(self, light: Light) -> Appearance:
        """Return it with templates drawn by a light, or by one shown now or before that is hardly another."""
        shown, before = to_show(light, (self.shown, *self.earlier)), self.shown
        if shown is before:
            return self
        earlier = (before, *(each for each in self.earlier if each is not shown))[:KEPT]
        return replace(self, shown=shown, earlier=earlier if light.count > MANY else ())


def _due(balls: int) -> bool:
    """Say whether templates should follow the light now."""
    every = PUBLISH_SOON if balls <= MANY else PUBLISH_LATE
    return balls in PUBLISH_AT or (balls > PUBLISH_AT[-1] and balls % every == 0)


def to_show(light: Light, known: Sequence[Light]) -> Light:
    """Return the light to draw templates by: where it is of many balls, one that was shown and is hardly another.

    known: the light shown now, which stays if it may, then those before.
    """
    if light.count <= MANY:
        return light
    if light.apart_from(known[0]) <= LEAST_CHANGE:
        return known[0]
    nearest = min(known, key=light.apart_from)
    return nearest if light.apart_from(nearest) <= LEAST_CHANGE else light


def _ray(ball: Expected, camera: Camera) -> tuple[float, float]:
    """Return the ray (x, y, 1) to a ball: the one expected, or where its place in the image leads."""
    if ball.ray is not None:
        return ball.ray
    x, y, z = camera.bearings(np.array([ball.uv_px]))[0].tolist()
    return x / z, y / z


@lru_cache(maxsize=4096)
def _shades(light: Light, camera: Camera, x_steps: int, y_steps: int) -> Shades:
    """Return the shades along a rounded bearing; light and camera are told apart by identity."""
    return light.shades(ray_frame(x_steps * BEARING_STEP_RAD, y_steps * BEARING_STEP_RAD, camera.R_CtoW))
