"""Goals of the actions, made of plain numbers. No I/O, no clock."""

from __future__ import annotations

import math
from collections.abc import Sequence

from custom_interfaces.action import (
    FollowVelocity,
    Land,
    Navigate,
    NavigateWaypoints,
    Orbit,
    ReturnToLaunch,
    Takeoff,
)
from custom_interfaces.msg import Waypoint
from drone_navigation.client.client_goal import ORBIT_YAW_MODES, ClientGoal
from navigation_bridge.names import (
    ACTION_NAME,
    FRAME_MAP,
    FRAME_WGS84,
    LAND_ACTION_NAME,
    ORBIT_ACTION_NAME,
    RETURN_ACTION_NAME,
    TAKEOFF_ACTION_NAME,
    VELOCITY_ACTION_NAME,
    WAYPOINTS_ACTION_NAME,
)
from navigation_core.geometry import Vector3

__all__ = ["landing", "orbit", "point", "return_to_launch", "route", "take_off", "velocity"]


def take_off(height_m: float) -> ClientGoal:
    """Return the goal to take off; a height of 0 is the server's default."""
    goal = Takeoff.Goal(height=float(height_m))
    return ClientGoal(Takeoff, TAKEOFF_ACTION_NAME, goal, f"take-off to {height_m:g} m")


def landing() -> ClientGoal:
    """Return the goal to land where the vehicle is."""
    return ClientGoal(Land, LAND_ACTION_NAME, Land.Goal(), "landing")


def return_to_launch() -> ClientGoal:
    """Return the goal to return to the launch point."""
    return ClientGoal(ReturnToLaunch, RETURN_ACTION_NAME, ReturnToLaunch.Goal(), "return to launch")


def point(
    position: Vector3, frame: str, yaw_deg: float | None, speed_m_s: float, avoid: bool
) -> ClientGoal:
    """Return the goal to fly to a position.

    Args:
        position: in its frame: metres, or latitude, longitude and altitude for `wgs84`.
        frame: `map`, `base_link` or `wgs84`.
        yaw_deg: counter-clockwise from x; None faces the direction of travel.
        speed_m_s: highest ground speed; 0 is the server's default.
        avoid: whether obstacles are avoided.
    """
    goal = Navigate.Goal(max_speed=float(speed_m_s), avoid_obstacles=avoid)
    goal.target_pose.header.frame_id = frame
    pose = goal.target_pose.pose
    pose.position.x, pose.position.y, pose.position.z = map(float, position)
    half_rad = 0.0 if yaw_deg is None else math.radians(yaw_deg) / 2.0
    # All zeros: the vehicle faces the direction of travel.
    pose.orientation.w = 0.0 if yaw_deg is None else math.cos(half_rad)
    pose.orientation.z = math.sin(half_rad)
    return ClientGoal(Navigate, ACTION_NAME, goal, f"goal {tuple(position)} in frame {frame}")


def route(
    positions: Sequence[Vector3],
    frame: str,
    hold_s: float | Sequence[float],
    speed_m_s: float,
    avoid: bool,
    laps: int,
    as_mission: bool,
) -> ClientGoal:
    """Return the goal to fly a route.

    Args:
        positions: its waypoints, each as that of a point.
        frame: `map` or `wgs84`, where altitudes are above mean sea level.
        hold_s: hold time at all, or at each; 0 flies through.
        speed_m_s: highest ground speed; 0 is the server's default.
        avoid: whether obstacles are avoided.
        laps: how often it is flown.
        as_mission: whether the autopilot flies it as a mission of its own.

    Raises:
        ValueError: another frame, or another number of hold times.
    """
    frames = {FRAME_MAP: Waypoint.FRAME_MAP, FRAME_WGS84: Waypoint.FRAME_GEODETIC_AMSL}
    if frame not in frames:
        raise ValueError(f"A route is in the frame 'map' or 'wgs84', not in '{frame}'.")
    goal = NavigateWaypoints.Goal(laps=laps, max_speed=float(speed_m_s), avoid_obstacles=avoid)
    if as_mission:
        goal.execution = NavigateWaypoints.Goal.EXECUTION_MISSION
    holds_s = [hold_s] * len(positions) if isinstance(hold_s, int | float) else hold_s
    for (x, y, z), own_s in zip(positions, holds_s, strict=True):
        waypoint = Waypoint(frame=frames[frame], hold_time=float(own_s))
        waypoint.position.x, waypoint.position.y, waypoint.position.z = float(x), float(y), float(z)
        goal.waypoints.append(waypoint)
    text = f"a route of {len(positions)} waypoints"
    return ClientGoal(
        NavigateWaypoints, WAYPOINTS_ACTION_NAME, goal, text, waypoints=len(positions)
    )


def orbit(
    centre: tuple[float, float],
    radius_m: float,
    height_m: float | None,
    laps: float,
    speed_m_s: float,
    yaw_mode: str,
    avoid: bool,
) -> ClientGoal:
    """Return the goal to fly a circle.

    Args:
        centre: x and y in the map, m.
        radius_m: negative flies clockwise seen from above.
        height_m: above the ground; None keeps the altitude.
        laps: may be a fraction; 0 flies until it is cancelled.
        speed_m_s: highest ground speed; 0 is the server's default.
        yaw_mode: `centre`, `tangent` or `keep`.
        avoid: whether obstacles on it are avoided.

    Raises:
        ValueError: another yaw mode.
    """
    if yaw_mode not in ORBIT_YAW_MODES:
        raise ValueError(f"The yaw of an orbit is one of {', '.join(ORBIT_YAW_MODES)}.")
    goal = Orbit.Goal(
        radius=float(radius_m),
        height=math.nan if height_m is None else float(height_m),
        laps=float(laps),
        max_speed=float(speed_m_s),
        yaw_mode=ORBIT_YAW_MODES[yaw_mode],
        avoid_obstacles=avoid,
    )
    goal.centre.header.frame_id = FRAME_MAP
    goal.centre.pose.position.x, goal.centre.pose.position.y = map(float, centre)
    return ClientGoal(Orbit, ORBIT_ACTION_NAME, goal, f"circle of {radius_m:g} m around {centre}")


def velocity(speed_m_s: float) -> ClientGoal:
    """Return the goal to follow velocity commands, of at most a ground speed; 0 is the default."""
    goal = FollowVelocity.Goal(max_speed=float(speed_m_s))
    return ClientGoal(FollowVelocity, VELOCITY_ACTION_NAME, goal, "following velocity commands")
