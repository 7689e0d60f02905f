"""Bridge, simulated vehicle and what is between them, flown on one simulated clock."""
