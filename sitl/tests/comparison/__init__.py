"""Recorded conversations with real autopilots: read, replayed and compared."""
