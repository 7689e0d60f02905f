"""Names that the server and its clients share."""

from __future__ import annotations

ACTION_NAME = "navigate_to_waypoint"
SERVER_NODE_NAME = "navigation_server"
