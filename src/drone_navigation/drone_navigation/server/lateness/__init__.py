"""Turns of the driver thread that take long: a trace of them, and short garbage collections."""
