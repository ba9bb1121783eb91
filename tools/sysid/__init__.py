"""System identification: a hover model of the vehicle, fitted to a flight log. docs/sysid.md is its manual."""
