"""PX4's side of the wire: what it answers, says and streams, a link at a time."""
