"""The topics on which servers reserve air space."""
