"""The autopilot's storage besides its mission: fence, rally points, parameters; their files."""
