"""Whether the cameras still stand where they did: by the room behind the vehicle, and by the rays to its balls."""
