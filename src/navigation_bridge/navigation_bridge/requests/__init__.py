"""Requests that are answered beside goals, each by a feature of the bridge."""
