"""Servers, clients, demos and terminals as processes."""
