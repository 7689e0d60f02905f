"""Serves the console over HTTP and WebSocket."""
