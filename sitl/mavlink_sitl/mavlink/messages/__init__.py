"""Telemetry, a function for each message."""
