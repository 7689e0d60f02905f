"""The navigation client."""
