"""Operations: commands, confirmed by the state of the vehicle."""
