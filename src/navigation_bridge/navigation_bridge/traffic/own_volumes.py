"""The volumes of what an autopilot flies by itself, as well as they are known. No ROS."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mavlink_vehicle.profiles import VehicleKind
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_core.geometry import Vector3
from navigation_core.tasks.traffic.traffic_view import TrafficView
from navigation_core.tasks.traffic.volumes import NOWHERE, Volume, densified, joined
from navigation_core.tasks.watching.plane_route import HEIGHT_ERROR_M

__all__ = [
    "climb",
    "is_plane",
    "landing",
    "return_home",
    "route",
    "standing",
    "to_circle",
]

# How far a plane and a multicopter stray sideways when the autopilot flies them.
_PLANE_STRAYS_M = 15.0
_STRAYS_M = 1.5
# A plane's circle is wider than its parameter says.
_CIRCLE_SHARE = 1.4
# Length of the run of a plane that takes off, until it is as high as its circle.
_RUN_M = 300.0
# Gap between the levels of an upright volume.
_LEVEL_GAP_M = 2.0


def is_plane(at: LocatedSnapshot) -> bool:
    """Whether the vehicle cannot stand still in the air."""
    return at.profile.kind is VehicleKind.PLANE


def standing(view: TrafficView, at: LocatedSnapshot, stop_m: float, is_parked: bool) -> Volume:
    """Return where a vehicle is and comes to rest if it brakes now.

    Args:
        view: its traffic.
        at: where it is.
        stop_m: its stopping distance.
        is_parked: whether it is disarmed on the ground.
    """
    start = np.array(at.position_enu_m)
    speed = float(np.linalg.norm(at.velocity_enu_m_s))
    points = start[None]
    if speed * stop_m > 0.01:
        end = start + np.array(at.velocity_enu_m_s) * (stop_m / speed)
        points, _ = densified(np.array([start, end]), np.zeros(2))
    placed = view.traffic_frame.traffic(points)
    volume = Volume.along(placed, view.radius_m, view.rise_m)
    return volume.parked(view.reservations.separation) if is_parked else volume


def climb(view: TrafficView, at: LocatedSnapshot, height_m: float) -> Volume:
    """Return the volume of a take-off to a height above the ground."""
    top_m = max(at.ground_enu_m + height_m, at.position_enu_m[2])
    if not is_plane(at):
        return _upright(view, at.position_enu_m, at.position_enu_m[2], top_m)
    x, y, z = at.position_enu_m
    run = (x + _RUN_M * math.cos(at.yaw_enu_rad), y + _RUN_M * math.sin(at.yaw_enu_rad), top_m)
    line, _ = densified(np.array([(x, y, z), run]), np.zeros(2))
    corridor = Volume.along(view.traffic_frame.traffic(line), _PLANE_STRAYS_M, HEIGHT_ERROR_M)
    return joined(corridor, _circle(view, run, at))


def landing(view: TrafficView, at: LocatedSnapshot) -> Volume:
    """Return the volume of a landing where the vehicle is."""
    low_m = min(at.ground_enu_m, at.position_enu_m[2])
    return _upright(view, at.position_enu_m, low_m, at.position_enu_m[2])


def return_home(view: TrafficView, at: LocatedSnapshot, return_height_m: float) -> Volume:
    """Return the volume of a return: up, to the launch point, and down there.

    Args:
        view: its traffic.
        at: where it is.
        return_height_m: height above the ground at which it returns.
    """
    home = at.home_enu_m
    if home is None:
        return landing(view, at) if at.traits.flies and not is_plane(at) else NOWHERE
    if not at.traits.flies:
        return route(view, at, (home,))
    x, y, z = at.position_enu_m
    top_m = max(z, at.ground_enu_m + return_height_m)
    if is_plane(at):
        return to_circle(view, at, (home[0], home[1], top_m))
    low_m = min(at.ground_enu_m, home[2], z)
    # A PX4 near its home, and an ArduCopter with a cone, climb less: all heights between are taken.
    line, _ = densified(np.array([(x, y, z), (home[0], home[1], z)]), np.zeros(2))
    middle, rise_m = 0.5 * (z + top_m), 0.5 * (top_m - z) + view.rise_m
    line[:, 2] = middle
    corridor = Volume.along(view.traffic_frame.traffic(line), _STRAYS_M + view.radius_m, rise_m)
    down = _upright(view, home, low_m, top_m)
    return joined(corridor, down, landing(view, at))


def route(view: TrafficView, at: LocatedSnapshot, targets_enu_m: Sequence[Vector3]) -> Volume:
    """Return the volume of a route from where the vehicle is."""
    if not targets_enu_m:
        return NOWHERE
    points = np.array([at.position_enu_m, *targets_enu_m])
    if not at.traits.flies:
        points[:, 2] = at.position_enu_m[2]
    line, _ = densified(points, np.zeros(len(points)))
    radius_m, rise_m = _STRAYS_M + view.radius_m, 2.0 * view.rise_m
    if is_plane(at):
        # It turns on the far side of each waypoint.
        radius_m, rise_m = _PLANE_STRAYS_M + at.traits.circle_radius_m, HEIGHT_ERROR_M
    path = Volume.along(view.traffic_frame.traffic(line), radius_m, rise_m)
    return joined(path, _circle(view, targets_enu_m[-1], at)) if is_plane(at) else path


def to_circle(
    view: TrafficView, at: LocatedSnapshot, target_enu_m: Vector3, circle_m: float | None = None
) -> Volume:
    """Return the volume of a plane's leg to a target that it then circles.

    Args:
        view: the traffic.
        at: the plane.
        target_enu_m: the centre.
        circle_m: the radius; its sign does not matter. None for the plane's usual one.
    """
    start = np.array(at.position_enu_m)
    line, _ = densified(np.array([start, target_enu_m]), np.zeros(2))
    path = Volume.along(view.traffic_frame.traffic(line), _PLANE_STRAYS_M, HEIGHT_ERROR_M)
    # It may have to turn round first.
    here = _disc(view, at.position_enu_m, 2.0 * at.traits.circle_radius_m + _PLANE_STRAYS_M)
    return joined(path, here, _circle(view, target_enu_m, at, circle_m))


def _circle(
    view: TrafficView, centre_enu_m: Vector3, at: LocatedSnapshot, circle_m: float | None = None
) -> Volume:
    radius_m = abs(circle_m or at.traits.circle_radius_m)
    return _disc(view, centre_enu_m, _CIRCLE_SHARE * radius_m + _PLANE_STRAYS_M)


def _disc(view: TrafficView, centre_enu_m: Vector3, radius_m: float) -> Volume:
    placed = view.traffic_frame.traffic(np.array([centre_enu_m]))
    return Volume.along(placed, radius_m, HEIGHT_ERROR_M)


def _upright(view: TrafficView, place_enu_m: Vector3, low_m: float, high_m: float) -> Volume:
    count = max(math.ceil((high_m - low_m) / _LEVEL_GAP_M), 1) + 1
    points = np.empty((count, 3))
    points[:, :2] = place_enu_m[:2]
    points[:, 2] = np.linspace(low_m, high_m, count)
    placed = view.traffic_frame.traffic(points)
    return Volume.along(placed, _STRAYS_M, view.rise_m + 0.5 * _LEVEL_GAP_M)
