"""Parameters and settings of a server: reading and validation."""
