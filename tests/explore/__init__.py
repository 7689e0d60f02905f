"""Exploration: random flights from one number each, checked by policies.

`python -m tests.explore --help` says how. A scenario is data; the same scenario gives the same
log, byte for byte.
"""
