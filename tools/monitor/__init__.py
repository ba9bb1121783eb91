"""`posebridge monitor`: a running bridge, or a log, on one page of a terminal."""
