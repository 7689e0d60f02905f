"""Topics that a server subscribes to."""
