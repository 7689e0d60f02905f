"""Flight logs that the vehicle keeps itself, and the service that gives them away."""
