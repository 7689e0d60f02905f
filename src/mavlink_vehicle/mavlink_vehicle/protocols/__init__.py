"""Sans-IO state machines, one MAVLink service per file.

Each has the six methods of `Protocol`: it does no I/O, holds no lock, reads no clock and logs
nothing. Time is an argument.
"""
