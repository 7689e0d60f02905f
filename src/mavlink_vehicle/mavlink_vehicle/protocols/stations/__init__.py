"""What other ground stations do to the vehicle."""
