"""What the autopilot stores besides its mission: fence, rally points, parameters; their files."""
