"""What is known about the vehicle, reduced from its messages."""
