"""The parameter service: all parameters read, some changed and read back."""
