"""Surveys: an area as it was sent, made into a route of waypoints with acts. No ROS."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from mavlink_vehicle.positions.frames import equidistant_at
from navigation_bridge.goals.requests import ActKind, ActRequest, AltitudeReference, WaypointRequest
from navigation_bridge.goals.route_requests import WAYPOINTS_MAX
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.surveys.area import Corners, SurveyArea, SurveyAreaError, area_of
from navigation_core.surveys.lines import Points
from navigation_core.surveys.survey import Survey, plan_survey
from navigation_core.surveys.terrain import (
    HEIGHT_MIN_M,
    Terrain,
    TerrainError,
    TerrainGrid,
    slopes,
    too_many_points,
)

__all__ = ["Camera", "SurveyRequest", "SurveyRoute", "compute_survey"]

SPACING_MIN_M, SPACING_MAX_M = 0.1, 10_000.0
OVERRUN_MAX_M = 1000.0
_OVERLAP_MAX = 0.98
_LATITUDE_MAX_DEG = 89.0
# Two waypoints that are nearer are one.
_SAME_M = 1e-3
_ROUNDING = 1e-6
# A slope that is none.
_LEVEL = 1e-6


@dataclass(frozen=True)
class Camera:
    """A camera that looks straight down, the width of its sensor across the lines.

    Attributes:
        sensor_width_m: of the sensor.
        sensor_height_m: of the sensor, along the lines.
        focal_length_m: of the lens.
        side_overlap: share of a picture that the next line sees, too.
        front_overlap: share that the next picture sees, too.
    """

    sensor_width_m: float
    sensor_height_m: float
    focal_length_m: float
    side_overlap: float
    front_overlap: float


@dataclass(frozen=True)
class SurveyRequest:
    """A request of ``custom_interfaces/srv/ComputeSurvey`` as it was sent.

    Attributes:
        boundary: corners: metres east and north, or latitude and longitude in degrees.
        holes: areas that are left out and not entered.
        altitude_reference: of the height; None for corners in the map frame.
        height_m: of all waypoints; above the terrain if that is given.
        spacing_m: of the lines; 0 = by the camera.
        camera: None without one.
        angle_enu_rad: of the lines, counter-clockwise from east; NaN = the best.
        entry: where the vehicle comes from; None = the first corner.
        overrun_m: how much farther lines begin and end.
        acceptance_radius_m: of the waypoints; 0 = the server's default.
        speed_m_s: for the duration.
        acceleration_m_s2: the same.
        terrain: whose ground the height follows, in the map frame; None = one height.
        climb_m_s: greatest rate with which the path over terrain may rise.
        descent_m_s: the same, downwards.
    """

    boundary: Corners
    holes: tuple[Corners, ...] = ()
    altitude_reference: AltitudeReference | None = None
    height_m: float = 0.0
    spacing_m: float = 0.0
    camera: Camera | None = None
    angle_enu_rad: float = math.nan
    entry: tuple[float, float] | None = None
    overrun_m: float = 0.0
    acceptance_radius_m: float = 0.0
    speed_m_s: float = 5.0
    acceleration_m_s2: float = 2.0
    terrain: TerrainGrid | None = None
    climb_m_s: float = math.inf
    descent_m_s: float = math.inf


@dataclass(frozen=True)
class SurveyRoute:
    """A route that surveys an area.

    Attributes:
        waypoints: at the ends of the lines and at the corners of the ways between them, and
            between these where the terrain takes it.
        length_m: from the first waypoint on, with climbs.
        duration_s: of that, with a stop at each end and corner; without wind.
        photos: how many a camera takes; 0 without one.
        area_m2: what is covered.
        angle_enu_rad: of the lines.
        spacing_m: of the lines.
    """

    waypoints: tuple[WaypointRequest, ...] = field(repr=False)
    length_m: float
    duration_s: float
    photos: int
    area_m2: float
    angle_enu_rad: float
    spacing_m: float


def compute_survey(request: SurveyRequest) -> SurveyRoute | Rejection:
    """Return the route of a survey, or why there is none.

    Args:
        request: as it was sent.
    """
    rejection = _problem(request)
    if rejection is not None:
        return rejection
    to_plane, from_plane = _plane(request)
    camera, height_m = request.camera, request.height_m
    spacing_m, trigger_m = request.spacing_m, 0.0
    if camera is not None:
        wide_m = height_m * camera.sensor_width_m / camera.focal_length_m
        high_m = height_m * camera.sensor_height_m / camera.focal_length_m
        spacing_m = spacing_m or wide_m * (1.0 - camera.side_overlap)
        trigger_m = high_m * (1.0 - camera.front_overlap)
    if not SPACING_MIN_M <= spacing_m <= SPACING_MAX_M:
        return _invalid(
            f"the spacing is {spacing_m:g} m; {SPACING_MIN_M:g} to {SPACING_MAX_M:g} m are planned."
        )
    angle = None if math.isnan(request.angle_enu_rad) else request.angle_enu_rad
    entry = request.boundary[0] if request.entry is None else request.entry
    try:
        area = area_of(
            tuple(to_plane(*corner) for corner in request.boundary),
            tuple(tuple(to_plane(*corner) for corner in hole) for hole in request.holes),
        )
        survey = plan_survey(area, spacing_m, to_plane(*entry), angle, request.overrun_m)
        route = _route(request, survey, area, trigger_m, from_plane)
        if request.terrain is not None:
            _check_slopes(route.waypoints, request)
        return route
    except (SurveyAreaError, TerrainError) as error:
        return Rejection(OutcomeCode.INVALID_WAYPOINTS, str(error))


def _invalid(text: str) -> Rejection:
    return Rejection(OutcomeCode.INVALID_NUMBER, f"{text[0].upper()}{text[1:]}")


def _problem(request: SurveyRequest) -> Rejection | None:
    """Return why numbers are no numbers of a survey; the area is checked later."""
    if not request.boundary:
        return _invalid("the boundary has no corners; give three.")
    camera = request.camera
    numbers = {
        "the height": request.height_m,
        "spacing": request.spacing_m,
        "overrun": request.overrun_m,
        "the speed": request.speed_m_s,
        "the entry": sum(request.entry or (0.0, 0.0)),
    }
    if camera is not None:
        numbers |= {name: getattr(camera, name) for name in camera.__dataclass_fields__}
    for name, value in numbers.items():
        if not math.isfinite(value):
            return _invalid(f"{name} is {value}; give a finite number.")
    if math.isinf(request.angle_enu_rad):
        return _invalid("the angle is infinite; give a finite number, or NaN for the best.")
    if request.spacing_m < 0.0 or not 0.0 <= request.overrun_m <= OVERRUN_MAX_M:
        return _invalid(
            f"spacing is {request.spacing_m:g} m and overrun {request.overrun_m:g} m; give 0 or "
            f"more, and an overrun of at most {OVERRUN_MAX_M:g} m."
        )
    if request.speed_m_s <= 0.0:
        return _invalid(f"the speed is {request.speed_m_s:g} m/s; give more than 0.")
    return (
        _problem_of_places(request)
        or _problem_of_camera(request, camera)
        or _problem_of_terrain(request)
    )


def _problem_of_places(request: SurveyRequest) -> Rejection | None:
    if request.altitude_reference is None:
        return None
    for corners in (request.boundary, *request.holes):
        for latitude_deg, longitude_deg in corners:
            if not (abs(latitude_deg) <= _LATITUDE_MAX_DEG and abs(longitude_deg) <= 180.0):
                return _invalid(
                    f"({latitude_deg}, {longitude_deg}) is no place; give latitude and longitude "
                    f"in degrees, the latitude up to {_LATITUDE_MAX_DEG:g}."
                )
    return None


def _problem_of_camera(request: SurveyRequest, camera: Camera | None) -> Rejection | None:
    if camera is None:
        if request.spacing_m > 0.0:
            return None
        return _invalid("there is neither a spacing nor a camera; give one.")
    if min(camera.sensor_width_m, camera.sensor_height_m, camera.focal_length_m) <= 0.0:
        return _invalid("the camera's sensor and focal length must be above 0 m.")
    if not all(0.0 <= o <= _OVERLAP_MAX for o in (camera.side_overlap, camera.front_overlap)):
        return _invalid(
            f"the overlaps are {camera.side_overlap:g} and {camera.front_overlap:g}; give 0 to "
            f"{_OVERLAP_MAX:g}."
        )
    if request.height_m <= 0.0 or request.altitude_reference is AltitudeReference.AMSL:
        return _invalid(
            "a camera sees an area by its height above the ground: give a height above 0 m that "
            "counts from home or from the ground."
        )
    return None


def _problem_of_terrain(request: SurveyRequest) -> Rejection | None:
    if request.terrain is None:
        return None
    if request.altitude_reference is not None:
        return Rejection(
            OutcomeCode.UNKNOWN_FRAME,
            "A grid of the terrain is in metres of the map; give the corners in the map frame.",
        )
    if request.height_m < HEIGHT_MIN_M:
        return _invalid(
            f"the height above the terrain is {request.height_m:g} m; give at least "
            f"{HEIGHT_MIN_M:g} m."
        )
    return None


def _plane(
    request: SurveyRequest,
) -> tuple[
    Callable[[float, float], tuple[float, float]], Callable[[float, float], tuple[float, float]]
]:
    """Return what converts the request's coordinates into metres east and north, and back."""
    if request.altitude_reference is None:
        return (lambda x, y: (x, y)), (lambda x, y: (x, y))
    latitude_deg, longitude_deg = request.boundary[0]
    origin = (latitude_deg, longitude_deg, 0.0)
    projection = equidistant_at(latitude_deg)

    def to_plane(latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        north_m, east_m = projection.to_local(latitude_deg, longitude_deg, origin)
        return east_m, north_m

    def from_plane(east_m: float, north_m: float) -> tuple[float, float]:
        return projection.to_geodetic(north_m, east_m, origin)

    return to_plane, from_plane


def _route(
    request: SurveyRequest,
    survey: Survey,
    area: SurveyArea,
    trigger_m: float,
    from_plane: Callable[[float, float], tuple[float, float]],
) -> SurveyRoute:
    """Return the waypoints of a survey.

    Raises:
        TerrainError: the terrain cannot be followed.
    """
    waypoints: list[WaypointRequest] = []
    photos, length_m, duration_s, stretch_m, placed = 0, 0.0, 0.0, 0.0, None
    terrain = None if request.terrain is None else Terrain(request.terrain)
    for leg in survey.legs:
        points = _raised(leg.points_m, request, terrain)
        if leg.covers and trigger_m:
            # Autopilots trigger by level distance: climbs take no more photos.
            photos += math.floor(leg.length_m / trigger_m + _ROUNDING) + 1
        for index, (point, is_corner) in enumerate(points):
            acts: tuple[ActRequest, ...] = ()
            if leg.covers and trigger_m and index in (0, len(points) - 1):
                distance_m = 0.0 if index else trigger_m
                acts = (ActRequest(ActKind.TRIGGER_DISTANCE, distance_m=distance_m),)
            if placed is not None and math.dist(placed, point) < _SAME_M:
                if acts:
                    last = waypoints.pop()
                    waypoints.append(_waypoint(request, last.position, last.acts + acts))
                continue
            if placed is not None:
                stretch_m += math.dist(placed, point)
            if is_corner:
                length_m, duration_s = length_m + stretch_m, duration_s + _leg_s(stretch_m, request)
                stretch_m = 0.0
            waypoints.append(_waypoint(request, (*from_plane(*point[:2]), point[2]), acts))
            placed = point
        if terrain is not None and len(waypoints) > WAYPOINTS_MAX:
            raise TerrainError(too_many_points(WAYPOINTS_MAX))
    return SurveyRoute(
        tuple(waypoints),
        length_m,
        duration_s,
        photos,
        area.area_m2,
        survey.angle_rad,
        survey.spacing_m,
    )


def _raised(
    points_m: Points, request: SurveyRequest, terrain: Terrain | None
) -> list[tuple[Vector3, bool]]:
    """Return the points of a leg at their heights, and which of them are its corners."""
    height_m = request.height_m
    if terrain is None:
        return [((float(east), float(north), height_m), True) for east, north in points_m]
    raised: list[tuple[Vector3, bool]] = []
    for first_m, last_m in itertools.pairwise(points_m):
        path_m = terrain.along(first_m, last_m, height_m, WAYPOINTS_MAX)
        places = [(float(east), float(north), float(up)) for east, north, up in path_m]
        raised += [(place, False) for place in places[:-1]]
        raised[-len(places) + 1] = (places[0], True)
    return [*raised, (places[-1], True)]


def _check_slopes(waypoints: tuple[WaypointRequest, ...], request: SurveyRequest) -> None:
    """Reject what climbs or falls faster than the vehicle may."""
    climb, descent = slopes(np.array([waypoint.position for waypoint in waypoints]))
    most_m_s = min(
        request.climb_m_s / max(climb, _LEVEL), request.descent_m_s / max(descent, _LEVEL)
    )
    if request.speed_m_s > most_m_s:
        raise TerrainError(
            f"At {request.speed_m_s:g} m/s the path rises with up to "
            f"{climb * request.speed_m_s:.1f} m/s and falls with up to "
            f"{descent * request.speed_m_s:.1f} m/s, and the vehicle's limits are "
            f"{request.climb_m_s:g} and {request.descent_m_s:g} m/s; give a max_speed of at most "
            f"{math.floor(100.0 * most_m_s) / 100.0:g} m/s."
        )


def _waypoint(
    request: SurveyRequest, position: Vector3, acts: tuple[ActRequest, ...]
) -> WaypointRequest:
    radius_m = request.acceptance_radius_m
    return WaypointRequest(position, request.altitude_reference, radius_m, acts=acts)


def _leg_s(length_m: float, request: SurveyRequest) -> float:
    """Return the time from rest to rest."""
    speed_m_s, acceleration_m_s2 = request.speed_m_s, request.acceleration_m_s2
    ramp_m = speed_m_s**2 / acceleration_m_s2
    if length_m < ramp_m:
        return 2.0 * math.sqrt(length_m / acceleration_m_s2)
    return length_m / speed_m_s + speed_m_s / acceleration_m_s2
