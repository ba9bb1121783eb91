"""Two runs beside each other: `posebridge compare`."""
