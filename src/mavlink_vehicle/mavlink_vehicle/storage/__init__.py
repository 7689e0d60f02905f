"""The storage besides the mission: fence, rally points and parameters, read, written, read back."""
