"""PX4's firmware: the same hooks as `autopilot.copter`, different behaviour."""
