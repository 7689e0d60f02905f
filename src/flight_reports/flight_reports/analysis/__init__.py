"""What a recording tells about a flight, as figures and events."""
