"""PX4's multicopter firmware: the same hooks as `autopilot.copter`, another temperament."""
