"""Commands of the client for the gimbal."""
