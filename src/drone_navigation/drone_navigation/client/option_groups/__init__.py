"""Options of single commands of the client."""
