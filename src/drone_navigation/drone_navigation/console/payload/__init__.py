"""The camera and the gimbal of a vehicle, for pages."""
