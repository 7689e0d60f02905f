"""The tasks that are served as actions, one file each: which goals are admitted, and who flies."""
