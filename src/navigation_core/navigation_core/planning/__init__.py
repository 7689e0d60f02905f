"""Paths around obstacles."""
