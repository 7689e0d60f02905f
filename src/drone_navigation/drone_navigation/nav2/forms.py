"""The forms of nav2_msgs, 1.3 to 1.5: what the installed classes define is served.

Each difference is found by asking the class that is there, never by a version or by the name of a
distribution. 1.4 (Kilted) has routes as `nav_msgs/Goals`, `WaypointStatus` for `MissedWaypoint`,
and the state of each pose in `navigate_through_poses`; 1.5 (Lyrical, Rolling) adds errors of
tracking, via points and error codes of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

from geometry_msgs.msg import PoseStamped
from nav2_msgs import action, msg, srv

from drone_navigation.nav2.outcomes import Nav2Outcome
from drone_navigation.nav2.tracking import tracking_errors
from mavlink_vehicle.positions.frames import normalize_angle
from navigation_core.geometry import Vector3

_NEEDED = "FollowGPSWaypoints"


class FieldNames(Protocol):
    """A message class of ROS."""

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        """Return the type of each field."""


def too_old() -> str | None:
    """Return why the installed nav2_msgs cannot be served; None if it can."""
    if hasattr(action, _NEEDED) and _explains(action.NavigateToPose):
        return None
    return (
        "The installed nav2_msgs is older than 1.3 (ROS 2 Jazzy): its results have no error_msg, "
        "by which a goal that is not flown is explained. navigation_client works without it."
    )


def _explains(kind: Any) -> bool:
    """Whether the result of an action has room for a reason. 1.3 had actions without."""
    return {"error_code", "error_msg"} <= set(kind.Result.get_fields_and_field_types())


def optional_actions(names: Sequence[str]) -> dict[str, Any]:
    """Return those actions that the installed nav2_msgs defines, with a reason in the result."""
    found = {name: getattr(action, name) for name in names if hasattr(action, name)}
    return {name: kind for name, kind in found.items() if _explains(kind)}


def optional_services(names: Sequence[str]) -> dict[str, Any]:
    """Return those services that the installed nav2_msgs defines."""
    return {name: getattr(srv, name) for name in names if hasattr(srv, name)}


def poses_of(route: Any) -> Sequence[PoseStamped]:
    """Return the poses of a route: a list, or `nav_msgs/Goals`."""
    poses: Sequence[PoseStamped] = getattr(route, "goals", route)
    return poses


def add_missed(
    message: Any, index: int, outcome: Nav2Outcome, pose: PoseStamped | None = None
) -> None:
    """Add a waypoint that was missed to the result of `follow_waypoints`.

    Args:
        message: the result.
        index: of the waypoint.
        outcome: of the goal.
        pose: of the waypoint, None if it is geodetic.
    """
    kind = _element_of(type(message), "missed_waypoints")
    if hasattr(kind, "waypoint_index"):
        missed = kind(waypoint_status=kind.FAILED, waypoint_index=index)
        missed.error_msg = outcome.message
    else:
        missed = kind(index=index)
    missed.error_code = outcome.code
    if pose is not None:
        setattr(missed, "waypoint_pose" if hasattr(missed, "waypoint_pose") else "goal", pose)
    message.missed_waypoints.append(missed)


def _element_of(kind: type[FieldNames], field: str) -> Any:
    """Return the class of the messages in a sequence."""
    name = kind.get_fields_and_field_types()[field]
    return getattr(msg, name.rpartition("/")[2].rstrip(">"))


def show_waypoints(
    message: Any, poses: Sequence[PoseStamped], passed: int, outcome: Nav2Outcome | None = None
) -> None:
    """Give the state of each pose of `navigate_through_poses`, where the message has it.

    Args:
        message: feedback or result.
        poses: of the goal.
        passed: how many of them the vehicle has passed.
        outcome: of the goal, None while it is flown. What is then left counts as the goal does.
    """
    if not hasattr(message, "waypoint_statuses"):
        return
    kind = _element_of(type(message), "waypoint_statuses")
    for index, pose in enumerate(poses):
        status = kind(waypoint_index=index, waypoint_pose=pose)
        if outcome is None:
            status.waypoint_status = kind.COMPLETED if index < passed else kind.PENDING
        elif (index < passed or outcome.code == 0) and index not in outcome.missed:
            status.waypoint_status = kind.COMPLETED
        else:
            status.waypoint_status = kind.FAILED
            status.error_code, status.error_msg = outcome.code, outcome.message
        message.waypoint_statuses.append(status)


def show_tracking(
    feedback: Any,
    position_enu_m: Vector3,
    yaw_enu_rad: float,
    plan_enu_m: Callable[[], Sequence[Vector3]],
) -> None:
    """Give the distance from the path and the angle to it, where the feedback has them.

    Args:
        feedback: of a goal to poses.
        position_enu_m: of the vehicle.
        yaw_enu_rad: of the vehicle.
        plan_enu_m: returns the path that is flown; empty if there is none.
    """
    if not hasattr(feedback, "position_tracking_error"):
        return
    errors = tracking_errors(plan_enu_m(), position_enu_m)
    if errors is None:
        return
    left_m, path_yaw_rad = errors
    feedback.position_tracking_error = left_m
    feedback.heading_tracking_error = normalize_angle(path_yaw_rad - yaw_enu_rad)
