"""Messages and frames: as an autopilot sends them, random, hostile."""
