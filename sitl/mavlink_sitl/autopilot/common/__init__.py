"""Firmware parts that all vehicle types share."""
