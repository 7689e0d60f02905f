"""Services and actions on what the autopilot stores: fence, rally points, parameters."""
