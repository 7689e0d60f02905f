"""Lists near the default home of the simulated vehicles, as a ground station uploads them."""

from __future__ import annotations

from typing import Any

from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import DEFAULT_HOME, LocalFrame, geodesy

Message = Any
_FRAME = LocalFrame(DEFAULT_HOME, geodesy.ARDUPILOT)


def position_1e7(north_m: float, east_m: float) -> tuple[int, int]:
    """Latitude and longitude, in 1e7 degrees."""
    point = _FRAME.to_geodetic(north_m, east_m, 0.0)
    return round(point.latitude_deg * 1e7), round(point.longitude_deg * 1e7)


def _item(
    command: int,
    north_m: float,
    east_m: float,
    up_m: float = 0.0,
    first: float = 0.0,
    frame: int = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT,
) -> Message:
    params = (first, 0.0, 0.0, 0.0)
    return mav.MAVLink_mission_item_int_message(
        1, 1, 0, frame, command, 0, 1, *params, *position_1e7(north_m, east_m), up_m, 0
    )


def home() -> Message:
    """Item 0 of an ArduPilot mission."""
    up_m = DEFAULT_HOME.altitude_amsl_m
    return _item(mav.MAV_CMD_NAV_WAYPOINT, 0.0, 0.0, up_m, frame=mav.MAV_FRAME_GLOBAL)


def take_off(height_m: float) -> Message:
    """An item without a place: it climbs where the vehicle is."""
    item = _item(mav.MAV_CMD_NAV_TAKEOFF, 0.0, 0.0, height_m)
    item.x = item.y = 0
    return item


def waypoint(north_m: float, east_m: float, up_m: float, stay_s: float = 0.0) -> Message:
    return _item(mav.MAV_CMD_NAV_WAYPOINT, north_m, east_m, up_m, stay_s)


def fence_with_hole() -> list[Message]:
    """A square of 200 m about home to stay in, and a circle of 8 m to keep out of."""
    corners = ((-100.0, -100.0), (-100.0, 100.0), (100.0, 100.0), (100.0, -100.0))
    vertex = mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
    square = [_item(vertex, *corner, first=4.0, frame=0) for corner in corners]
    return [*square, _item(mav.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION, 30.0, 30.0, first=8.0, frame=0)]


def rally_point() -> Message:
    return _item(mav.MAV_CMD_NAV_RALLY_POINT, 20.0, -10.0, 15.0)
