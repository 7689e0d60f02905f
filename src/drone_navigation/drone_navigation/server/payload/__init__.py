"""The vehicle's gimbal and camera, for clients."""
