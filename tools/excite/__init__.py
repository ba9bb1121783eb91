"""Manoeuvres that show how a vehicle answers its sticks: planned inside the flight volume, flown by the demo."""
