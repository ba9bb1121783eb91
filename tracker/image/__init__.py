"""From an image to balls: what they look like, where they are to a part of a pixel."""
