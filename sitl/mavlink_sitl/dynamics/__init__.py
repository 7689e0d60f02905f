"""Dynamics of vehicles and batteries: pure functions over lanes (see `mavlink_sitl.lanes`)."""
