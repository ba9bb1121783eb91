"""From sightings to a first pose, without a track: and the paper's own method."""
