"""The talk with one autopilot over one link: who it is, what time it has, where its origin is, what it is sent."""

from bridge.dialogue.dialogue import Dialogue, DialogueState, Terms
from bridge.dialogue.ear import Ear
from bridge.dialogue.origin import Origin, Tellings
from bridge.dialogue.profile import PROFILES, Profile

__all__ = ["PROFILES", "Dialogue", "DialogueState", "Ear", "Origin", "Profile", "Tellings", "Terms"]
