"""Sockets, hosts and channels that a test can cut."""
