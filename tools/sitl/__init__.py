"""Fly an autopilot's own software in the loop: simulated cameras, the whole tracker and bridge, real MAVLink."""
