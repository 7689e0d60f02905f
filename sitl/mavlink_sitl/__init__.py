"""Simulated MAVLink autopilots: seeded, deterministic, faster than real time."""
