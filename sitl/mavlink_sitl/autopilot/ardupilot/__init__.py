"""ArduPilot."""
