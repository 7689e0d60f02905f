"""PX4 for a rover or boat."""
