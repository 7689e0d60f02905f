"""One simulated vehicle: its body, its firmware, and what is injected into it."""
