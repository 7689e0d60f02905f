"""Axes, local frames and projections, and whether a position can be trusted."""
