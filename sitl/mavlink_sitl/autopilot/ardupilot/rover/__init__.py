"""ArduRover."""
