"""The simulated view: where the vehicle truly is -> what each camera's image holds.

Nothing here is shared with the detector: colour is made by light, paint and sensor, not by a box in HSV, and an edge is
ray-traced, not drawn as a circle.
"""

from tracker.scene.look import Lamp, Look
from tracker.scene.render import SceneRenderer
from tracker.scene.thing import Bar, Sphere, hand
from tracker.scene.trouble import Knock, Occluder, Trouble
from tracker.scene.vehicle import Pose

__all__ = ["Bar", "Knock", "Lamp", "Look", "Occluder", "Pose", "SceneRenderer", "Sphere", "Trouble", "hand"]
