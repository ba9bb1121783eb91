"""Files that hold calibrated cameras, ours and other programs'."""
