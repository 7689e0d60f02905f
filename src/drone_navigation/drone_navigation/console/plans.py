"""QGroundControl `.plan` files and waypoints of a vehicle's map. No ROS."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from functools import cache
from typing import Any

from drone_navigation.console.acts.page_acts import ACTS_MAX, act_command, page_act
from drone_navigation.console.messages import PageWaypoint
from drone_navigation.console.page_types import FenceValue, HomeValue, ItemsValue, JsonObject
from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.positions.frames import Geodetic, LocalFrame, Projection
from mavlink_vehicle.profiles import profile_for
from mavlink_vehicle.profiles.equipment import EquipmentRules
from navigation_bridge.goals.requests import AltitudeReference
from navigation_bridge.plan_files.items import PlanError
from navigation_bridge.plan_files.routes import parse_route
from navigation_core.geometry import Vector3

__all__ = [
    "PlanError",
    "earth",
    "in_map_of",
    "make_plan",
    "map_waypoints",
    "stored_plan",
    "vehicle_map",
]

# Of two numbers for the same frame, the one that QGroundControl writes.
_FILE_FRAMES = {
    mavlink.MAV_FRAME_GLOBAL_INT: mavlink.MAV_FRAME_GLOBAL,
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT: mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT,
    mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT: mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT,
}
_FIRMWARES = (mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_AUTOPILOT_PX4)


@cache
def _projections() -> dict[str, Projection]:
    """Return how each autopilot, by the name in VehicleStatus, lays its map over the earth."""
    profiles = (
        profile_for(firmware, kind) for firmware in _FIRMWARES for kind in mavlink.enums["MAV_TYPE"]
    )
    return {profile.name: profile.projection for profile in profiles if profile.projection}


def vehicle_map(autopilot: str, home: HomeValue | None) -> tuple[LocalFrame, Geodetic]:
    """Return the vehicle's map, and home in degrees and metres above mean sea level.

    Args:
        autopilot: as in VehicleStatus.
        home: as of `facts.home`.

    Raises:
        PlanError: nobody knows where the map lies on the earth.
    """
    projection = _projections().get(autopilot)
    if projection is None:
        raise PlanError(
            "The vehicle's firmware is unknown, so positions cannot be converted to degrees."
        )
    place = _home_place(home)
    if home is None or home["at"] is None or place is None:
        raise PlanError("The vehicle's home is not known yet.")
    east_m, north_m, up_m = home["at"]
    return LocalFrame.through(place, (north_m, east_m, -up_m), projection), place


def _home_place(home: HomeValue | None) -> Geodetic | None:
    if home is None:
        return None
    latitude, longitude, altitude = home["latitude"], home["longitude"], home["altitude"]
    if latitude is None or longitude is None or altitude is None:
        return None
    return latitude, longitude, altitude


def earth(autopilot: str, home: HomeValue | None) -> dict[str, object] | None:
    """Return where the vehicle's map lies on the earth, None if nobody knows.

    Args:
        autopilot: as in VehicleStatus.
        home: as of `facts.home`.

    Returns:
        origin: latitude and longitude of the map's zero, degrees; and the attributes of the
        firmware's projection.
    """
    try:
        frame, _ = vehicle_map(autopilot, home)
    except PlanError:
        return None
    projection: Any = frame.projection
    return {"origin": frame.origin[:2], **asdict(projection)}


def in_map_of(
    points_enu_m: Sequence[Vector3],
    own: tuple[str, HomeValue | None],
    other: tuple[str, HomeValue | None],
) -> tuple[Vector3, ...]:
    """Return points of a vehicle's map in that of another one.

    Args:
        points_enu_m: in the map of the vehicle.
        own: its autopilot, as in VehicleStatus, and its home, as of `facts.home`.
        other: those of the other vehicle.

    Raises:
        PlanError: it is unknown where one of the maps lies.
    """
    here, there = vehicle_map(*own)[0], vehicle_map(*other)[0]
    found = []
    for east_m, north_m, up_m in points_enu_m:
        north_there_m, east_there_m, down_m = there.ned_m(here.geodetic((north_m, east_m, -up_m)))
        found.append((east_there_m, north_there_m, -down_m))
    return tuple(found)


def map_waypoints(
    text: str, autopilot: str, home: HomeValue | None
) -> tuple[list[JsonObject], tuple[str, ...]]:
    """Return the waypoints of a plan in the vehicle's map, and notes on what was left out.

    Args:
        text: of the file.
        autopilot: as in VehicleStatus.
        home: as of `facts.home`.

    Raises:
        PlanError: it cannot be flown, or nobody knows where that is.
    """
    frame, home_place = vehicle_map(autopilot, home)
    route = parse_route(text)
    notes = list(route.notes)
    found: list[JsonObject] = []
    left_out = False
    for number, waypoint in enumerate(route.waypoints, start=1):
        latitude_deg, longitude_deg, altitude_m = waypoint.position
        if waypoint.altitude_reference is AltitudeReference.GROUND:
            raise PlanError(
                f"Waypoint {number} has a height above terrain, which the map lacks; fly this plan "
                "with navigation_client."
            )
        if waypoint.altitude_reference is AltitudeReference.HOME:
            altitude_m += home_place[2]
        north_m, east_m, down_m = frame.ned_m((latitude_deg, longitude_deg, altitude_m))
        place = {"x": round(east_m, 2), "y": round(north_m, 2), "z": round(-down_m, 2)}
        acts = [act for act in map(page_act, waypoint.acts) if act is not None]
        left_out = left_out or len(acts[:ACTS_MAX]) < len(waypoint.acts)
        more = {"acts": acts[:ACTS_MAX]} if acts else {}
        found.append({**place, "hold": waypoint.hold_time_s, **more})
    if any(w.yaw_enu_rad is not None or w.max_speed_m_s for w in route.waypoints):
        notes.append("Headings and speeds of single waypoints are left out.")
    if left_out:
        notes.append(
            "Servo outputs, cameras that look at a place or a compass heading, and more "
            f"than {ACTS_MAX} acts of a waypoint are left out; navigation_client flies them."
        )
    return found, tuple(notes)


def make_plan(waypoints: Sequence[PageWaypoint], autopilot: str, home: HomeValue | None) -> str:
    """Return the text of a plan with heights above home.

    Raises:
        PlanError: nobody knows where the waypoints are.
    """
    frame, home_place = vehicle_map(autopilot, home)
    items: list[dict[str, object]] = []
    for waypoint in waypoints:
        east_m, north_m, up_m = waypoint.position_enu_m
        latitude_deg, longitude_deg, altitude_m = frame.geodetic((north_m, east_m, -up_m))
        place = [round(latitude_deg, 8), round(longitude_deg, 8)]
        height_m = round(altitude_m - home_place[2], 2)
        items.append(
            {
                "type": "SimpleItem",
                "autoContinue": True,
                "command": mavlink.MAV_CMD_NAV_WAYPOINT,
                "frame": mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT,
                "doJumpId": len(items) + 1,
                "params": [waypoint.hold_time_s, 0, 0, None, *place, height_m],
            }
        )
        for act in waypoint.acts:
            command = act_command(act, EquipmentRules())
            params = [value if math.isfinite(value) else None for value in command.params]
            items.append(
                {
                    "type": "SimpleItem",
                    "autoContinue": True,
                    "command": command.command,
                    "frame": mavlink.MAV_FRAME_MISSION,
                    "doJumpId": len(items) + 1,
                    "params": [*params, *[0] * (7 - len(params))],
                }
            )
    return _plan(items, autopilot, home_place, [], [], [])


def stored_plan(
    mission: ItemsValue | None,
    fence: FenceValue | None,
    rally: ItemsValue | None,
    autopilot: str,
    home: HomeValue | None,
) -> str:
    """Return the text of a plan with all that the vehicle stores.

    Fence and rally points are in it, too: whoever uploads a plan without them deletes them.

    Args:
        mission: as of `facts.stored_items`.
        fence: as of `facts.fence`.
        rally: as of `facts.stored_items`.
        autopilot: as in VehicleStatus.
        home: as of `facts.home`.

    Raises:
        PlanError: something is not known yet, or there is no mission.
    """
    place = _home_place(home)
    if mission is None or fence is None or rally is None or place is None:
        raise PlanError("The vehicle's stored mission has not been read yet.")
    if not mission["items"]:
        raise PlanError("The vehicle stores no mission.")
    # In a file items are counted from 1; those of a DO_JUMP, too.
    shift = 1 - mission["items"][0]["number"]
    items = []
    for item in mission["items"]:
        params = list(item["values"])
        target = params[0]
        if item["command"] == mavlink.MAV_CMD_DO_JUMP and target is not None:
            params[0] = target + shift
        items.append(
            {
                "type": "SimpleItem",
                "autoContinue": True,
                "command": item["command"],
                "frame": _FILE_FRAMES.get(item["frame"], item["frame"]),
                "doJumpId": item["number"] + shift,
                "params": params,
            }
        )
    circles, polygons = [], []
    for area in fence["areas"]:
        if not area["stored"]:
            continue  # parameters make it
        shape: dict[str, object] = {"inclusion": area["inclusion"], "version": 1}
        if area["radius"] is None:
            polygons.append({**shape, "polygon": area["places"]})
        else:
            circle = {"center": area["places"][0], "radius": area["radius"]}
            circles.append({**shape, "circle": circle})
    points = [item["values"][4:] for item in rally["items"]]
    return _plan(items, autopilot, place, circles, polygons, points)


def _plan(
    items: list[dict[str, object]],
    autopilot: str,
    home: Geodetic,
    circles: list[dict[str, object]],
    polygons: list[dict[str, object]],
    rally_points: list[list[float | None]],
) -> str:
    px4 = autopilot in {
        profile_for(mavlink.MAV_AUTOPILOT_PX4, kind).name for kind in mavlink.enums["MAV_TYPE"]
    }
    document = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "QGroundControl",
        "geoFence": {"circles": circles, "polygons": polygons, "version": 2},
        "rallyPoints": {"points": rally_points, "version": 2},
        "mission": {
            "version": 2,
            "firmwareType": _FIRMWARES[px4],
            "vehicleType": mavlink.MAV_TYPE_QUADROTOR,
            "cruiseSpeed": 15,
            "hoverSpeed": 5,
            "plannedHomePosition": list(home),
            "items": items,
        },
    }
    return json.dumps(document, indent=4)
