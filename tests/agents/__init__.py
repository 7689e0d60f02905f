"""Films of agents, and the commands that make them."""
