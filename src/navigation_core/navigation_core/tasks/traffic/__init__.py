"""Vehicles that keep apart: volumes, right of way, reservations, detours around each other."""
