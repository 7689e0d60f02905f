"""The mission service."""
