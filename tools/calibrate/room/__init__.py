"""`posebridge calibrate`: where the room's cameras stand, from what they see."""
