"""The task that follows velocity commands."""
