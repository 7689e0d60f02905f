"""What tells about obstacles, brought together in the map frame."""
