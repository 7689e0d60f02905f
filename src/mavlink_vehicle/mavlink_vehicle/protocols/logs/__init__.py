"""The autopilot's own logs: listed and downloaded by LOG_REQUEST_*, one transfer at a time."""
