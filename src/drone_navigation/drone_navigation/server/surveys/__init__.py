"""The service that computes surveys."""
