"""What a firmware does with its own devices: outputs, and sensors to be calibrated."""
