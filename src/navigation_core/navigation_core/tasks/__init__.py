"""Navigation tasks: what a goal makes the vehicle do, step by step."""
