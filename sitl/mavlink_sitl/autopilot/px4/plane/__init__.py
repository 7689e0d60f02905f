"""PX4 for a fixed-wing aeroplane."""
