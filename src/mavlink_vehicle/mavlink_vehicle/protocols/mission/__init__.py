"""The mission service, and the stored mission."""
