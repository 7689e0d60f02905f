"""Vehicle aspects for goals: capabilities, position, other operators."""
