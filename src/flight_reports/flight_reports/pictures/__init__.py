"""Pictures and films of a flight."""
