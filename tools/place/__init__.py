"""`posebridge place`: the best camera poses for a room, and the paper's figures."""
