"""Safety of a vehicle: arming checks, failsafes, fence, rally points."""
