"""Calibration of cameras: boards, views, fits, verdicts, and other programs' files. docs/calibrate.md is its manual."""
