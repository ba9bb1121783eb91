"""Pictures of the vehicle in the room, one camera at a time."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from tracker.camera import Camera
from tracker.rig import Marker, Rig
from tracker.scene.backdrop import backdrop, vignette
from tracker.scene.look import NO_TROUBLE, Look, Trouble
from tracker.scene.sensor import Plane, Sensor, to_light
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
        return self._views[camera].render(poses, Trouble(trouble.light_gain, occluders))


class _View:
    """One camera's backdrop, painters and sensor."""

    def __init__(self, camera: Camera, marker: Marker, look: Look, seed: tuple[int, int], given: Image | None) -> None:
        rng = np.random.default_rng(seed)
        size = (camera.width_px, camera.height_px)
        room: Image | Plane = backdrop(*size, rng) if given is None else given
        self._camera = camera
        self._look = look
        self._vignette = np.ascontiguousarray(np.broadcast_to(vignette(*size), (size[1], size[0], 3)))
        self._backdrop: Plane = _blurred(to_light(room), look.blur_px) * self._vignette
        self._sensor = Sensor(*size, look, rng)
        self._still = self._sensor.develop(self._backdrop)
        self._vehicle = VehiclePainter(camera, marker, look)

    def render(self, poses: Sequence[Pose], trouble: Trouble) -> Image:
        """Render one image."""
        display, sigma = self._still if trouble.light_gain == 1.0 else self._lit(trouble.light_gain)
        noise = self._sensor.next_noise()
        image = self._sensor.expose(display, sigma, noise)
        vehicle = self._vehicle.paint(poses)
        if vehicle is not None:
            window = (
                slice(vehicle.v_px, vehicle.v_px + len(vehicle.layer)),
                slice(vehicle.u_px, vehicle.u_px + vehicle.layer.shape[1]),
            )
            patch = self._behind(vehicle.layer, window) * np.float32(trouble.light_gain)
            image[window] = self._sensor.expose(*self._sensor.develop(patch), noise[window])
        for each in trouble.occluders:
            corner = (each.u_px + each.width_px, each.v_px + each.height_px)
            cv2.rectangle(image, (each.u_px, each.v_px), corner, each.bgr, cv2.FILLED)
        return self._sensor.compress(image)

    def _lit(self, gain: float) -> tuple[Plane, Plane]:
        return self._sensor.develop(self._backdrop * np.float32(gain))

    def _behind(self, vehicle: Plane, window: tuple[slice, slice]) -> Plane:
        """Blur the vehicle's layer (h, w, 4) by the lens and put the backdrop behind it; return the light (h, w, 3)."""
        layer = _blurred(vehicle, self._look.blur_px)
        light = self._backdrop[window] * (1.0 - layer[..., 3:]) + layer[..., :3] * self._vignette[window]
        return np.asarray(light, dtype=np.float32)


def _blurred(plane: Plane, sigma_px: float) -> Plane:
    if sigma_px <= 0:
        return plane
    return np.asarray(cv2.GaussianBlur(plane, (0, 0), sigma_px), dtype=np.float32)
