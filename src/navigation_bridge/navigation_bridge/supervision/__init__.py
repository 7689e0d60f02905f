"""What is watched beside the flight itself: health, position, pilots, other stations."""
