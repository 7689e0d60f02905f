"""Rules that end, hold or pause a goal, and their verdicts."""
