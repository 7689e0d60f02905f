"""Requests, admission and life cycle of goals."""
