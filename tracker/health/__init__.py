"""Whether the cameras still stand where they were calibrated: the room behind the vehicle, and the rays to its balls."""
