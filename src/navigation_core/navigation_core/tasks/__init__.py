"""Navigation tasks: each carries out a goal step by step."""
