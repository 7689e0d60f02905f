"""Parameters and settings: read, checked, explained."""
