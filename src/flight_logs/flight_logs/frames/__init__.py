"""MAVLink frames in the bytes of a log: found, checked, stamped and grouped."""
