"""PX4 for a multicopter."""
