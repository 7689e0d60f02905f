"""The surroundings and what the sensors make of them, seeded."""
