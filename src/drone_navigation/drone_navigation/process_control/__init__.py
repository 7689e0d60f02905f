"""How a node starts without noise, and ends on a signal."""
