"""Small mathematics of the tracker: rotations, small systems, limits."""
