"""The state of the link and of the vehicle's failsafes: heartbeats, clocks, gaps."""
