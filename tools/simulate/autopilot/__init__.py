"""A simulated autopilot that keeps the rules ArduPilot applies to external vision."""
