"""The vehicles' bodies, as pure functions over lanes.

Each `step` takes the state, a command, where it matters the wind (speed of the air, NED m/s), the
height of the ground or of the water (NED down, m), the time to pass (s), the model and the
arithmetic (`lanes.Ops`). It returns the state that much later.
"""
