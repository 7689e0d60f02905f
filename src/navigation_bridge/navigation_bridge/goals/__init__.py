"""Goals as they are sent, checked and admitted, and their life cycle."""
