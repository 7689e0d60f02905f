"""The numeric half: bodies, sensors and controllers of all vehicles, in step."""
