"""Files that hold calibrated cameras."""
