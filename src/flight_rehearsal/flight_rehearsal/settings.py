"""Settings of the server, the simulated vehicle and the world, from a request."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import chain, repeat

from flight_rehearsal.flight_parameters import SERVER_PARAMETERS
from flight_rehearsal.request import RehearsalRequest
from mavlink_sitl import (
    DEFAULT_HOME,
    BatteryModel,
    GeoPoint,
    LocalFrame,
    Underway,
    VehicleConfig,
    Wind,
    World,
)
from navigation_bridge.configuration.known_obstacles import BoxEntry, CylinderEntry, KnownObstacles
from navigation_bridge.configuration.make_config import ServerConfig, make_config
from navigation_bridge.configuration.settings import SafetyConfig

__all__ = ["home_point", "origin_of", "server_config", "vehicle_config", "world"]

_STEPS_HZ, _AVOIDING_HZ = 5.0, 3.0
"""Rate of setpoints and positions, 20 in a real flight; lower with obstacles, which cost more"""
_RATES_HZ = {
    "EXTENDED_SYS_STATE": 4.0,
    "SYS_STATUS": 1.0,
    "BATTERY_STATUS": 0.5,
    "ATTITUDE": 5.0,
    "HOME_POSITION": 0.5,
    "CURRENT_MODE": 5.0,
}
_POLYGONS = 4
"""Of FENCE_TYPE: the fence's areas, which no order has"""


def server_config(order: RehearsalRequest) -> ServerConfig:
    """Return the server's settings, with the known obstacles, at low rates.

    Raises:
        ConfigurationError: they cannot be used.
    """
    given = {k: v for k, v in (order.server or {}).items() if k in SERVER_PARAMETERS}
    rate_hz = _AVOIDING_HZ if order.avoid_obstacles else _STEPS_HZ
    config = make_config({**given, "setpoint_rate_hz": rate_hz, "feedback_rate_hz": 1.0})
    positions = {"GLOBAL_POSITION_INT": rate_hz, "LOCAL_POSITION_NED": rate_hz}
    posts = [
        CylinderEntry(
            name=name, at_m=(x, y), radius_m=radius, bottom_m=bottom, height_m=top - bottom
        )
        for (x, y, radius, bottom, top), name in zip(
            order.posts, _padded(order.post_names), strict=False
        )
    ]
    boxes = [
        BoxEntry(
            at_m=(x, y), size_m=(2.0 * length, 2.0 * width), yaw_deg=math.degrees(yaw_rad),
            bottom_m=bottom, height_m=top - bottom, name=name,
        )
        for (x, y, length, width, yaw_rad, bottom, top), name in zip(
            order.boxes, _padded(order.box_names), strict=False
        )
    ]  # fmt: skip
    obstacles = replace(config.bridge.obstacles, known=KnownObstacles(items=(*posts, *boxes)))
    return replace(
        config,
        vehicle=replace(
            config.vehicle, message_rates_hz=positions | _RATES_HZ, optional_rates_hz={}
        ),
        bridge=replace(config.bridge, obstacles=obstacles),
    )


def _padded(names: tuple[str, ...]) -> Iterator[str]:
    """Return names, and then none for ever."""
    return chain(names, repeat(""))


def home_point(order: RehearsalRequest) -> GeoPoint | None:
    """Return where home is on the earth, if that is known."""
    home = order.home
    if home is None:
        return None
    return GeoPoint(home.latitude_deg, home.longitude_deg, home.altitude_amsl_m)


def origin_of(order: RehearsalRequest, kind: str, autopilot: str) -> GeoPoint:
    """Return the place of the map's origin on the earth, by home's places there and in the map."""
    point = home_point(order)
    if order.home is None or point is None:
        return DEFAULT_HOME
    east, north, up = order.home.position_enu_m
    projection = VehicleConfig(kind, autopilot).personality().projection
    return LocalFrame(point, projection).to_geodetic(-north, -east, up)


def vehicle_config(
    order: RehearsalRequest, kind: str, autopilot: str, origin: GeoPoint
) -> VehicleConfig:
    """Return the simulated vehicle: where and as the real one is.

    Raises:
        ConfigurationError: it cannot be.
    """
    east, north, up = order.position_enu_m
    v_east, v_north, v_up = order.velocity_enu_m_s
    moves = order.armed and (order.flying or kind != "copter")
    parameters = dict(order.parameters or {})
    if "FENCE_TYPE" in parameters:
        parameters["FENCE_TYPE"] = int(parameters["FENCE_TYPE"]) & ~_POLYGONS
    if autopilot == "px4" and "SIM_BAT_DRAIN" not in parameters:  # a real one
        default_s = SafetyConfig().battery_endurance_s
        assumed_s = float((order.server or {}).get("battery_endurance_s", default_s))
        endurance_s = assumed_s if not order.consumption_per_s else 1.0 / order.consumption_per_s
        parameters |= {"SIM_BAT_DRAIN": endurance_s, "SIM_BAT_MIN_PCT": 0.0}
    capacity_mah = parameters.get("BATT_CAPACITY", 0.0)
    battery = BatteryModel()
    if capacity_mah > 0.0:
        battery = battery._replace(capacity_mah=capacity_mah)
    return VehicleConfig(
        kind,
        autopilot,
        home=origin,
        heading_deg=90.0 - math.degrees(order.yaw_enu_rad),
        ready_after_s=0.0,
        parameters=parameters,
        battery=battery,
        battery_remaining=1.0 if order.battery is None else order.battery,
        underway=Underway((north, east, -up), (v_north, v_east, -v_up), moves),
    )


def world(order: RehearsalRequest, kind: str, origin: GeoPoint) -> World:
    """Return a plain on which the vehicle stands, or its home, and the wind."""
    up_m = order.home.position_enu_m[2] if order.home else 0.0
    if not order.flying or kind != "copter":
        up_m = order.position_enu_m[2]
    east, north, up = order.wind_enu_m_s
    ground = origin._replace(altitude_amsl_m=origin.altitude_amsl_m + up_m)
    return World(origin=ground, wind=Wind((north, east, -up)))
