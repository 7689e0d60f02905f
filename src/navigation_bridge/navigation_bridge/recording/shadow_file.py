"""Reader of the YAML file of ``--shadow-goals`` (`shadow_goals.schema.json`). No ROS."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from navigation_bridge.configuration.checked_yaml import hold, load_yaml
from navigation_bridge.configuration.parameter_values import ConfigurationError
from navigation_bridge.configuration.text_files import read_text
from navigation_bridge.goals.requests import (
    AltitudeReference,
    LandRequest,
    NavigateRequest,
    Request,
    ReturnRequest,
    TakeoffRequest,
    WaypointRequest,
    WaypointsRequest,
)
from navigation_bridge.names import (
    ACTION_NAMES,
    LAND_ACTION_NAME,
    RETURN_ACTION_NAME,
    TAKEOFF_ACTION_NAME,
    WAYPOINTS_ACTION_NAME,
)
from navigation_core.geometry import Vector3

# The numbers of Waypoint.msg.
_REFERENCES = {
    0: None,
    1: AltitudeReference.AMSL,
    2: AltitudeReference.HOME,
    3: AltitudeReference.GROUND,
}


class ShadowGoalsError(ConfigurationError):
    """A shadow goal file is invalid; the message says where and why."""


@dataclass(frozen=True)
class ShadowGoal:
    """A goal to run against a recording.

    Attributes:
        at_s: time at which it is sent, in seconds from the recording's beginning.
        action: name of its action.
        request: the request.
        cancel_at_s: time at which it is cancelled, or None.
    """

    at_s: float
    action: str
    request: Request
    cancel_at_s: float | None = None


@cache
def schema() -> dict[str, Any]:
    """Return the JSON Schema of a shadow goal file."""
    file = Path(__file__).with_name("shadow_goals.schema.json")
    return dict(json.loads(file.read_text("utf-8")))


def read_shadow_goals(path: Path) -> tuple[ShadowGoal, ...]:
    """Read a shadow goal file; goals are ordered by time.

    Raises:
        ShadowGoalsError: it cannot be read, or does not match the schema.
    """
    name = str(path)
    data = load_yaml(read_text(path, ShadowGoalsError), name, ShadowGoalsError)
    outside = {**data, "goals": []} if isinstance(data, dict) else data
    if isinstance(data, dict) and not (isinstance(data.get("goals"), list) and data["goals"]):
        outside = data
    rules = schema()
    if outside is not data:
        any_number = {**rules["properties"]["goals"], "minItems": 0}
        rules = {**rules, "properties": {"goals": any_number}}
    hold(outside, rules, name, ShadowGoalsError)
    goals = [_goal(item, f"{name}: goals[{i}]") for i, item in enumerate(data["goals"])]
    return tuple(sorted(goals, key=lambda goal: goal.at_s))


def _goal(item: Any, where: str) -> ShadowGoal:
    action = item.get("action") if isinstance(item, dict) else None
    if action not in ACTION_NAMES:
        raise ShadowGoalsError(
            f"{where}: action is missing; give one of {', '.join(ACTION_NAMES)}."
        )
    definitions = schema()["$defs"]
    title = f"{where} ({action})"
    hold(item, {**definitions[action], "$defs": definitions}, title, ShadowGoalsError)
    _check_finite(item, title)
    cancel_at_s = item.get("cancel_at_s")
    if cancel_at_s is not None and cancel_at_s < item["at_s"]:
        raise ShadowGoalsError(f"{title}: cancel_at_s is before at_s.")
    return ShadowGoal(item["at_s"], action, _request(action, item.get("goal", {})), cancel_at_s)


def _request(action: str, goal: Mapping[str, Any]) -> Request:
    if action == TAKEOFF_ACTION_NAME:
        return TakeoffRequest(float(goal.get("height", 0.0)))
    if action == LAND_ACTION_NAME:
        return LandRequest()
    if action == RETURN_ACTION_NAME:
        return ReturnRequest()
    speed_m_s, avoid = float(goal.get("max_speed", 0.0)), goal.get("avoid_obstacles", False)
    if action == WAYPOINTS_ACTION_NAME:
        return WaypointsRequest(
            waypoints=tuple(_waypoint(waypoint) for waypoint in goal["waypoints"]),
            by_mission=goal.get("execution", 0) == 1,
            laps=goal.get("laps", 0),
            max_speed_m_s=speed_m_s,
            avoid_obstacles=avoid,
        )
    target = goal["target_pose"]
    # The default of geometry_msgs/Quaternion is (0, 0, 0, 1).
    q = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0} | target["pose"].get("orientation", {})
    return NavigateRequest(
        frame_id=target.get("header", {}).get("frame_id", ""),
        position=_vector(target["pose"]["position"]),
        orientation_xyzw=(float(q["x"]), float(q["y"]), float(q["z"]), float(q["w"])),
        avoid_obstacles=avoid,
        max_speed_m_s=speed_m_s,
    )


def _waypoint(waypoint: Mapping[str, Any]) -> WaypointRequest:
    yaw = waypoint.get("yaw", 0.0)
    return WaypointRequest(
        position=_vector(waypoint["position"]),
        altitude_reference=_REFERENCES[waypoint.get("frame", 0)],
        acceptance_radius_m=float(waypoint.get("acceptance_radius", 0.0)),
        hold_time_s=float(waypoint.get("hold_time", 0.0)),
        yaw_enu_rad=float(yaw) if waypoint.get("use_yaw", False) else None,
        max_speed_m_s=float(waypoint.get("max_speed", 0.0)),
    )


def _vector(position: Mapping[str, float]) -> Vector3:
    return float(position["x"]), float(position["y"]), float(position["z"])


def _check_finite(value: object, where: str) -> None:
    """Reject .nan and .inf of YAML; a schema's limits accept NaN."""
    if isinstance(value, float) and not math.isfinite(value):
        raise ShadowGoalsError(f"{where}: {value} is not a finite number.")
    children = value.values() if isinstance(value, dict) else value
    for child in children if isinstance(children, (list, type({}.values()))) else ():
        _check_finite(child, where)
