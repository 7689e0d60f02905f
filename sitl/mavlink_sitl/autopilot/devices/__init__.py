"""The firmware's devices: outputs, and sensors to be calibrated."""
