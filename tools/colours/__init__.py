"""`posebridge colours`: learn the balls' colours and the room's from footage, and say what clashes."""
