"""Topics and transforms that a server publishes."""
