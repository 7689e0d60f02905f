"""Recorded conversations with real autopilots: read, played again, and compared."""
