"""The terminal of the navigation client: live view, lines, keys, progress."""
