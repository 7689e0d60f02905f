"""The state of the vehicle, reduced from its messages."""
