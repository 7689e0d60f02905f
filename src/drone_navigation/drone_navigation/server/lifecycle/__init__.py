"""The life cycle of the server as a managed node."""
