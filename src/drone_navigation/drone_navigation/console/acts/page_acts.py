"""Acts at waypoints as a page writes them, as messages, and as items of a plan. No I/O, no clock.

Angles of a page are degrees: above the horizon, and to the right of the nose.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from custom_interfaces.msg import WaypointAct
from drone_navigation.console.page_types import JsonObject
from mavlink_vehicle.profiles.equipment import EquipmentCommand, EquipmentRules
from navigation_bridge.configuration.checked_values import (
    Kind,
    RecordMember,
    number,
    one_of,
    record,
)
from navigation_bridge.goals.requests import ActKind, ActRequest, PointMode

__all__ = ["ACTS_MAX", "PAGE_ACT", "PageAct", "act_command", "act_message", "page_act"]

ACTS_MAX = 20
"""Of one waypoint, as of the server"""


@dataclass(frozen=True)
class PageAct:
    """An act; each kind reads its own attributes.

    Attributes:
        kind: "photo", "distance", "point", "neutral", "grab", "release" or "wait".
        distance_m: distance between photos; 0 ends them.
        pitch_deg: of the camera, above the horizon.
        right_deg: of the camera, to the right of the nose.
        duration_s: how long to hold.
    """

    kind: str
    distance_m: float = 0.0
    pitch_deg: float = 0.0
    right_deg: float = 0.0
    duration_s: float = 0.0


def _required(low: float, high: float, name: str) -> RecordMember[float]:
    return RecordMember(number(low, high), required=True, name=name)


_PLAIN = ("photo", "neutral", "grab", "release")
PAGE_ACT: Kind[PageAct] = one_of(
    "kind",
    {name: record(PageAct, fixed={"kind": name}) for name in _PLAIN}
    | {
        "distance": record(
            PageAct, fixed={"kind": "distance"}, distance_m=_required(0, 1000, "metres")
        ),
        "point": record(
            PageAct,
            fixed={"kind": "point"},
            pitch_deg=_required(-90, 90, "up"),
            right_deg=_required(-180, 180, "right"),
        ),
        "wait": record(PageAct, fixed={"kind": "wait"}, duration_s=_required(0.1, 3600, "seconds")),
    },
)
"""An act, by its `kind`"""


def act_message(act: PageAct) -> WaypointAct:
    """Return the message of an act."""
    if act.kind == "photo":
        return WaypointAct(kind=WaypointAct.PHOTO)
    if act.kind == "distance":
        return WaypointAct(kind=WaypointAct.TRIGGER_DISTANCE, distance=act.distance_m)
    if act.kind == "neutral":
        return WaypointAct(kind=WaypointAct.POINT, point=WaypointAct.POINT_NEUTRAL)
    if act.kind == "wait":
        return WaypointAct(kind=WaypointAct.WAIT, duration=act.duration_s)
    if act.kind == "point":
        return WaypointAct(
            kind=WaypointAct.POINT,
            point=WaypointAct.POINT_ANGLE,
            pitch=math.radians(act.pitch_deg),
            yaw=-math.radians(act.right_deg),
        )
    grabs = act.kind == "grab"
    return WaypointAct(
        kind=WaypointAct.GRIPPER,
        gripper=WaypointAct.GRIPPER_GRAB if grabs else WaypointAct.GRIPPER_RELEASE,
    )


def act_command(act: PageAct, equipment: EquipmentRules) -> EquipmentCommand:
    """Return the command that stands for an act in a plan."""
    if act.kind == "photo":
        return equipment.photo()
    if act.kind == "distance":
        return equipment.trigger_distance(act.distance_m)
    if act.kind == "neutral":
        return equipment.point_neutral(stored=True)
    if act.kind == "wait":
        return equipment.wait(act.duration_s)
    if act.kind == "point":
        return equipment.point_angle(act.pitch_deg, act.right_deg, locked=False, stored=True)
    return equipment.gripper(grabs=act.kind == "grab")


def page_act(act: ActRequest) -> JsonObject | None:
    """Return an act as the page writes it; None for one that it has not."""
    if act.kind is ActKind.PHOTO:
        return {"kind": "photo"}
    if act.kind is ActKind.TRIGGER_DISTANCE:
        return {"kind": "distance", "metres": round(act.distance_m, 2)}
    if act.kind is ActKind.WAIT:
        return {"kind": "wait", "seconds": round(act.duration_s, 1)}
    if act.kind is ActKind.GRIPPER:
        return {"kind": "grab" if act.grabs else "release"}
    if act.kind is ActKind.POINT and act.point is PointMode.NEUTRAL:
        return {"kind": "neutral"}
    if act.kind is ActKind.POINT and act.point is PointMode.ANGLE and not act.yaw_locked:
        up_deg, right_deg = math.degrees(act.pitch_rad), -math.degrees(act.yaw_rad)
        return {"kind": "point", "up": round(up_deg, 1), "right": round(right_deg, 1)}
    return None
