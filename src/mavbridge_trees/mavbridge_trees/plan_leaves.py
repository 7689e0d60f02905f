"""The leaf that flies a step of a plan, and the step as it is rehearsed."""

from __future__ import annotations

import math
from collections.abc import Sequence

from py_trees.behaviour import Behaviour

from custom_interfaces.msg import Waypoint
from mavbridge_trees.leaves import (
    FlyOrbit,
    FlyRoute,
    GoTo,
    HoldFor,
    LandHere,
    Photo,
    Return,
    TakeOff,
)
from mavbridge_trees.plan import PlanStep

__all__ = ["leaf_of", "rehearsed"]

# A photo takes about this long.
_PHOTO_S = 1.0


def leaf_of(step: PlanStep, route: Sequence[Waypoint]) -> Behaviour:
    """Return what flies a step.

    Args:
        step: the step.
        route: the waypoints of a survey.
    """
    values = step.values
    speed_m_s, avoid = float(values.get("speed", 0.0)), bool(values.get("avoid", False))
    if step.kind == "takeoff":
        return TakeOff(float(values["height"]))
    if step.kind == "goto":
        x, y, z = map(float, values["position"])
        return GoTo((x, y, z), speed_m_s, avoid)
    if step.kind == "orbit":
        x, y = map(float, values["centre"])
        height_m = float(values.get("height", math.nan))
        laps = float(values.get("laps", 1.0))
        return FlyOrbit((x, y), float(values["radius"]), laps, height_m, speed_m_s, avoid)
    if step.kind == "survey":
        return FlyRoute(route, speed_m_s, name="survey")
    if step.kind == "wait":
        return HoldFor(float(values["seconds"]))
    plain: dict[str, type[Photo | Return | LandHere]] = {
        "photo": Photo,
        "return": Return,
        "land": LandHere,
    }
    return plain[step.kind]()


def rehearsed(step: PlanStep, route: Sequence[Waypoint]) -> dict[str, object]:
    """Return a step by the names of `flight_rehearsal`; the arguments are those of `leaf_of`."""
    values = step.values
    common = {"speed": values.get("speed", 0.0), "avoid": values.get("avoid", False)}
    if step.kind == "takeoff":
        return {"kind": "takeoff", "height": values["height"]}
    if step.kind == "goto":
        return {"kind": "go", "points": [values["position"]], **common}
    if step.kind == "orbit":
        circle = {key: values[key] for key in ("radius", "laps", "height") if key in values}
        return {"kind": "orbit", "points": [[*values["centre"], 0.0]], **circle, **common}
    if step.kind == "survey":
        points = [[w.position.x, w.position.y, w.position.z] for w in route]
        return {"kind": "route", "points": points, **common}
    if step.kind in ("photo", "wait"):
        return {"kind": "wait", "seconds": values.get("seconds", _PHOTO_S)}
    return {"kind": step.kind}
