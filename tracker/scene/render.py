"""Pictures of the vehicle in the room, one camera at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from tracker.camera import Camera
from tracker.rig import Marker, Rig
from tracker.scene.backdrop import backdrop, vignette
from tracker.scene.knock import knocked, seen_from
from tracker.scene.look import Look
from tracker.scene.sensor import Plane, Sensor, to_light
from tracker.scene.trouble import AS_LIT, NO_TROUBLE, Knock, Trouble
from tracker.scene.vehicle import Pose, VehiclePainter
from tracker.types import Image


class SceneRenderer:
    """Render what the cameras of a rig see of a vehicle.

    Light is added up linearly: the vehicle at each sub-exposure as a layer of colour and cover, their mean blurred by
    the lens and laid over the still backdrop; then vignette, sensor noise, gamma and eight bits. Only the patch
    around the vehicle is computed anew for each frame. The same seed and the same calls give the same bytes.
    """

    def __init__(
        self, rig: Rig, look: Look | None = None, seed: int = 0, backdrops: Sequence[Image] | None = None
    ) -> None:
        """Prepare the backdrops.

        Args:
            rig: cameras and marker.
            look: light, lens and sensor; None for the default.
            seed: of the backdrops and the noise.
            backdrops: an image of its camera's size for each camera, instead of the made-up room.
        """
        look = look or Look()
        self._views = [
            _View(camera, rig.marker, look, (seed, index), backdrops[index] if backdrops else None)
            for index, camera in enumerate(rig.cameras)
        ]

    def render(self, camera: int, poses: Sequence[Pose], trouble: Trouble = NO_TROUBLE) -> Image:
        """Render one image (h, w, 3) BGR.

        Args:
            camera: index into the rig's cameras.
            poses: the vehicle's poses at even steps over the exposure, one or more.
            trouble: what spoils the picture.
        """
        occluders = tuple(each for each in trouble.occluders if each.camera == camera)
        knocks = tuple(each for each in trouble.knocks if each.camera == camera)
        return self._views[camera].render(poses, replace(trouble, occluders=occluders, knocks=knocks))


class _View:
    """One camera's backdrop, painters and sensor."""

    def __init__(self, camera: Camera, marker: Marker, look: Look, seed: tuple[int, int], given: Image | None) -> None:
        rng = np.random.default_rng(seed)
        size = (camera.width_px, camera.height_px)
        room: Image | Plane = backdrop(*size, rng) if given is None else given
        self._camera = camera
        self._marker = marker
        self._look = look
        self._vignette = np.ascontiguousarray(np.broadcast_to(vignette(*size), (size[1], size[0], 3)))
        self._room: Plane = _blurred(to_light(room, look.gamma), look.blur_px)
        self._backdrop: Plane = self._room * self._vignette
        self._sensor = Sensor(*size, look, rng)
        self._gain = AS_LIT
        self._knocks: tuple[Knock, ...] = ()
        self._still = self._sensor.develop(self._backdrop)
        self._vehicle = VehiclePainter(camera, marker, look)

    def render(self, poses: Sequence[Pose], trouble: Trouble) -> Image:
        """Render one image."""
        self._stand(trouble.knocks)
        gain = self._light(trouble.gain_bgr)
        display, sigma = self._still
        noise = self._sensor.next_noise()
        image = self._sensor.expose(display, sigma, noise)
        vehicle = self._vehicle.paint(poses, trouble)
        if vehicle is not None:
            window = (
                slice(vehicle.v_px, vehicle.v_px + len(vehicle.layer)),
                slice(vehicle.u_px, vehicle.u_px + vehicle.layer.shape[1]),
            )
            patch = self._behind(vehicle.layer, window) * gain
            image[window] = self._sensor.expose(*self._sensor.develop(patch), noise[window])
        for each in trouble.occluders:
            corner = (each.u_px + each.width_px, each.v_px + each.height_px)
            cv2.rectangle(image, (each.u_px, each.v_px), corner, each.bgr, cv2.FILLED)
        return _broken(self._sensor.compress(image), trouble.broken_from)

    def _stand(self, knocks: tuple[Knock, ...]) -> None:
        """Stand where these knocks bring the camera, and see room and vehicle from there."""
        if knocks == self._knocks:
            return
        self._knocks, camera, room = knocks, self._camera, self._room
        for knock in knocks:
            camera = knocked(camera, knock)
        if knocks:
            room = seen_from(room, self._camera, camera)
        self._backdrop = room * self._vignette
        self._vehicle = VehiclePainter(camera, self._marker, self._look)
        self._still = self._sensor.develop(self._backdrop * np.array(self._gain, dtype=np.float32))

    def _light(self, gain_bgr: tuple[float, float, float]) -> Plane:
        """Light the backdrop anew if the light has changed; return the gain (3,)."""
        gain = np.array(gain_bgr, dtype=np.float32)
        if gain_bgr != self._gain:
            self._gain, self._still = gain_bgr, self._sensor.develop(self._backdrop * gain)
        return gain

    def _behind(self, vehicle: Plane, window: tuple[slice, slice]) -> Plane:
        """Blur the vehicle's layer (h, w, 4) by the lens and put the backdrop behind it; return the light (h, w, 3)."""
        layer = _blurred(vehicle, self._look.blur_px)
        light = self._backdrop[window] * (1.0 - layer[..., 3:]) + layer[..., :3] * self._vignette[window]
        return np.asarray(light, dtype=np.float32)


def _blurred(plane: Plane, sigma_px: float) -> Plane:
    if sigma_px <= 0:
        return plane
    return np.asarray(cv2.GaussianBlur(plane, (0, 0), sigma_px), dtype=np.float32)


def _broken(image: Image, share: float) -> Image:
    """Spoil the rows below a share of the height: shifted and off in colour, as after a lost marker in a JPEG."""
    first = round(share * len(image))
    if first >= len(image):
        return image
    shifted = np.roll(image[first:], image.shape[1] // 3, axis=1).astype(np.int64) + np.array([40, 0, 70])
    return np.concatenate((image[:first], shifted.clip(0, 255).astype(np.uint8)))
