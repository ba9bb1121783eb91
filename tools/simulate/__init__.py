"""A helicopter, its autopilot and a room for them: what the bridge needs to be tried with nothing attached."""
