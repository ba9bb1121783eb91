"""Where to put the cameras: the paper's sections 2 and 3.2, and what a rig's lenses can know of a pose."""
