"""Tasks that the vehicle flies by itself while the task monitors it."""
