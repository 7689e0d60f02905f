"""What keeps a vehicle safe: arming checks, failsafes, fence, rally points."""
