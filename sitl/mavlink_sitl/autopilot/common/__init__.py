"""What the firmwares of all vehicles share."""
