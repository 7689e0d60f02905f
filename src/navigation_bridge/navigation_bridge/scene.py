"""The scene that a client draws: fence, flight volume, mission, rally points. No ROS."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.mission_items import AMSL, RELATIVE_ALT, TERRAIN_ALT, MissionItem, has_place
from mavlink_vehicle.positions.frames import Geodetic
from mavlink_vehicle.state.reducer import VehicleState
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.configuration.settings import BridgeConfig
from navigation_bridge.vehicle.fence import PlacedAreas, fence_of, has_areas
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_core.geometry import Vector3
from navigation_core.safety.fences import Area, CircleArea, PolygonArea
from navigation_core.safety.target_checks import FlightVolume

_RELATIVE = frozenset({RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT})
_AMSL = frozenset({AMSL, mavlink.MAV_FRAME_GLOBAL})
_TERRAIN = frozenset({TERRAIN_ALT, mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT})
_GLOBAL = _RELATIVE | _AMSL | _TERRAIN


@dataclass(frozen=True)
class SceneArea:
    """An area in the map frame.

    Attributes:
        area: the area.
        stored: whether it was uploaded to the autopilot.
        in_force: whether it is enforced.
        corners_deg: latitude and longitude of its corners, or its centre.
    """

    area: Area
    stored: bool
    in_force: bool
    corners_deg: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class SceneFence:
    """A fence, or the flight volume.

    Attributes:
        areas: circles and polygons.
        one_suffices: whether one of the inclusions suffices.
        altitude_min_m: least height above home, NaN without one.
        altitude_max_m: greatest height above home, NaN without one.
    """

    areas: tuple[SceneArea, ...]
    one_suffices: bool
    altitude_min_m: float
    altitude_max_m: float


@dataclass(frozen=True)
class SceneItem:
    """A stored item.

    Attributes:
        number: the autopilot's own.
        item: as it is stored.
        position_enu_m: in the map frame; NaN where unknown.
    """

    number: int
    item: MissionItem
    position_enu_m: Vector3


class Scene:
    """Places what the vehicle and the server know in the map frame."""

    def __init__(self, vehicle: Vehicle, map_frame: MapFrame, config: BridgeConfig) -> None:
        """Read from these."""
        self._vehicle = vehicle
        self._map_frame = map_frame
        self._areas = PlacedAreas()
        self._config = config

    def configure(self, config: BridgeConfig) -> None:
        """Apply other settings."""
        self._config = config

    @property
    def place(self) -> tuple[object, ...]:
        """The map's origin and home, on which all positions in the map depend."""
        return (self._map_frame.frame, self._vehicle.state.home)

    def fence(self) -> SceneFence | None:
        """Return the vehicle's fence, None while it is unknown."""
        vehicle, frame = self._vehicle, self._map_frame.frame
        profile, items, parameters = (
            vehicle.profile,
            vehicle.stored_lists.fence,
            vehicle.parameters.values,
        )
        if profile is None or frame is None or (items is None and has_areas(profile, parameters)):
            return None
        stored = self._areas.of(items, frame, self._map_frame.enu)
        home_enu_m = self._map_frame.home_enu_m(vehicle.state)
        fence = fence_of(profile, parameters, home_enu_m, stored)
        if fence is None:
            return None
        enforced = (*fence.areas, *fence.alternatives)
        areas = [*stored, *(area for area in enforced if area not in stored)]
        return SceneFence(
            tuple(self._placed(area, area in stored, area in enforced) for area in areas),
            bool(fence.alternatives),
            _or_nan(fence.altitude_min_m),
            _or_nan(fence.altitude_max_m),
        )

    def volume(self) -> SceneFence | None:
        """Return the flight volume, None while the map frame is unknown."""
        if self._map_frame.frame is None:
            return None
        volume = self._config.volume
        areas: list[Area] = [CircleArea((0.0, 0.0), volume.radius_max_m)]
        if volume.box is not None:
            (west, south, _), (east, north, _) = volume.box.minimum_enu_m, volume.box.maximum_enu_m
            areas.append(PolygonArea(((west, south), (east, south), (east, north), (west, north))))
        low_m, high_m = self._heights_m(volume)
        return SceneFence(
            tuple(self._placed(area, False, True) for area in areas), False, low_m, high_m
        )

    def _heights_m(self, volume: FlightVolume) -> tuple[float, float]:
        """Return the least and the greatest height above home."""
        state = self._vehicle.state
        home_z_m = self._map_frame.home_z_enu_m(state)
        # Whole metres: the position wanders while the vehicle stands.
        ground_m = round(self._map_frame.ground_enu_m(state) - home_z_m)
        low_m, high_m = ground_m + volume.altitude_min_m, ground_m + volume.altitude_max_m
        if volume.box is not None:
            low_m = max(low_m, volume.box.minimum_enu_m[2] - home_z_m)
            high_m = min(high_m, volume.box.maximum_enu_m[2] - home_z_m)
        return low_m, high_m

    def _placed(self, area: Area, stored: bool, in_force: bool) -> SceneArea:
        points = (area.centre_enu_m,) if isinstance(area, CircleArea) else area.corners_enu_m
        places = (self._map_frame.geodetic((*point, 0.0)) for point in points)
        return SceneArea(area, stored, in_force, tuple(place[:2] for place in places))

    def mission(self) -> tuple[SceneItem, ...] | None:
        """Return the stored mission without ArduPilot's home, None while it is unknown."""
        return self._items(
            self._vehicle.stored_lists.mission, self._vehicle.stored_lists.mission_offset
        )

    def rally_points(self) -> tuple[SceneItem, ...] | None:
        """Return the stored rally points, None while they are unknown."""
        return self._items(self._vehicle.stored_lists.rally_points, 0)

    def _items(
        self, items: Sequence[MissionItem] | None, first: int
    ) -> tuple[SceneItem, ...] | None:
        if items is None or self._map_frame.frame is None:
            return None
        state = self._vehicle.state
        return tuple(
            SceneItem(number, item, self._position_enu_m(item, state))
            for number, item in enumerate(items, start=first)
        )

    def _position_enu_m(self, item: MissionItem, state: VehicleState) -> Vector3:
        if item.frame not in _GLOBAL or not has_place(item):
            return (math.nan, math.nan, math.nan)
        altitude_m = math.nan
        if item.frame in _AMSL:
            altitude_m = item.z
        elif item.frame in _RELATIVE and state.home is not None:
            altitude_m = state.home.altitude_amsl_m + item.z
        unknown = not math.isfinite(altitude_m)
        place: Geodetic = (item.x * 1e-7, item.y * 1e-7, 0.0 if unknown else altitude_m)
        east_m, north_m, up_m = self._map_frame.enu(place)
        return (east_m, north_m, math.nan if unknown else up_m)


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value
