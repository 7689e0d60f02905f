"""PX4's firmware: the same hooks as ArduPilot's, different behaviour."""
