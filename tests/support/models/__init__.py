"""The least of a vehicle, an autopilot, the earth and motion, to hold the real ones against."""
