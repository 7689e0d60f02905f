"""Recordings: made, large or of others, how to read them, and what they give."""
