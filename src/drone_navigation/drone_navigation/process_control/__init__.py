"""Starts of nodes without noise, and their end on a signal."""
