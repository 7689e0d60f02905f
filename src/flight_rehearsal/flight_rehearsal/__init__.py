"""A goal flown in the simulator before it is sent: the bridge's own code, faster than real time.

The vehicle begins where the real one is and as it moves, with its parameters, the wind and the
obstacles that are known. `python -m flight_rehearsal` serves requests by its standard streams.
"""
