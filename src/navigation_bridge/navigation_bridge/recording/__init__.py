"""Notes in recordings, replay, and shadow goals."""
