"""Messages that are sent continuously: setpoints, external positions, GNSS corrections."""
