"""Names shared by server and clients: actions, the node, frames of goals."""

from __future__ import annotations

ACTION_NAME = "navigate_to_waypoint"
WAYPOINTS_ACTION_NAME = "navigate_waypoints"
ORBIT_ACTION_NAME = "orbit"
TAKEOFF_ACTION_NAME = "takeoff"
LAND_ACTION_NAME = "land"
RETURN_ACTION_NAME = "return_to_launch"
# Not among those below: they are steered while they run, and cannot be written down as goals.
VELOCITY_ACTION_NAME = "follow_velocity"
FOLLOW_ACTION_NAME = "follow_target"
TRAJECTORY_ACTION_NAME = "follow_trajectory"
ACTION_NAMES = (
    ACTION_NAME,
    WAYPOINTS_ACTION_NAME,
    ORBIT_ACTION_NAME,
    TAKEOFF_ACTION_NAME,
    LAND_ACTION_NAME,
    RETURN_ACTION_NAME,
)
DOWNLOAD_LOG_ACTION_NAME = "download_log"
POINT_GIMBAL_ACTION_NAME = "point_gimbal"
SERVER_NODE_NAME = "navigation_server"
FRAME_MAP = "map"
FRAME_ODOM = "odom"
FRAME_BASE_LINK = "base_link"
FRAME_WGS84 = "wgs84"
