"""Actions of other ground stations on the vehicle."""
