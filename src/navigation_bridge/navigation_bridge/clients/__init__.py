"""Requests of clients: goals, and the services beside a goal."""
