"""Cameras that were bumped in flight, mended from the flight's log."""
