"""ArduPilot's own vehicle tests against the simulated autopilot."""
