"""Commands of every ArduPilot for its devices, mostly given on the ground."""
