"""The other vehicles: what each holds, waits for and announces, by what its autopilot does."""
