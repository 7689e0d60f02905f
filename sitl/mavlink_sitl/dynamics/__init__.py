"""How vehicles and batteries move: pure functions over lanes (see `mavlink_sitl.lanes`)."""
