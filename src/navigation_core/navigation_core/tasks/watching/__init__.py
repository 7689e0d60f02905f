"""Tasks that the vehicle flies by itself, and that watch over it."""
