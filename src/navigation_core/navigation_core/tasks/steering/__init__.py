"""The tasks that are steered: by velocity commands, and beside a target."""
