"""The map frame: ENU metres whose origin is the vehicle's local (EKF) origin. No ROS."""

from __future__ import annotations

from drone_navigation.requests import MapPose
from mavlink_vehicle import frames
from mavlink_vehicle.state import VehicleState
from navigation_core.geometry import Vector3

# Latitude and longitude in degrees, altitude above mean sea level in metres.
Geodetic = tuple[float, float, float]

# MAV_TYPE_GROUND_ROVER and MAV_TYPE_SURFACE_BOAT (minimal.xml).
_DRIVING = frozenset({10, 11})
# GLOBAL_POSITION_INT and LOCAL_POSITION_NED that are this near in time describe the same
# moment well enough to tell where the origin lies (at 10 m/s they differ by 1 m).
_PAIR_AGE_S = 0.1


class MapFrame:
    """Finds the origin and converts the vehicle's telemetry into the map frame.

    The origin is what the autopilot says (GPS_GLOBAL_ORIGIN). One that does not say it
    gets an origin computed from a pair of GLOBAL_POSITION_INT and LOCAL_POSITION_NED; that
    one is kept until the autopilot restarts, so that the frame does not wander.
    """

    def __init__(self) -> None:
        """Start without an origin."""
        self._origin: Geodetic | None = None
        self._boot_count: int | None = None

    @property
    def origin(self) -> Geodetic | None:
        """Latitude, longitude and altitude (above mean sea level) of the map origin."""
        return self._origin

    def update(self, state: VehicleState) -> None:
        """Learn the origin from a new state; forget it when the autopilot restarted."""
        if state.boot_count != self._boot_count:
            self._boot_count = state.boot_count
            self._origin = None
        if state.origin is not None:
            origin = state.origin
            self._origin = (origin.latitude_deg, origin.longitude_deg, origin.altitude_amsl_m)
        elif self._origin is None:
            self._origin = _origin_from_pair(state)

    def pose(self, state: VehicleState) -> MapPose | None:
        """Return the pose that GLOBAL_POSITION_INT and ATTITUDE give, or None.

        None means that there is no valid position, no origin or no heading yet. A local
        position must be there, too: an ArduCopter sends GLOBAL_POSITION_INT before its
        estimator uses the GPS, but LOCAL_POSITION_NED only from then on.
        """
        position = state.global_position
        if self._origin is None or position is None or not state.position_valid:
            return None
        if state.local_position is None:
            return None
        yaw_ned_rad = (
            state.attitude.yaw_ned_rad if state.attitude is not None else position.heading_ned_rad
        )
        if yaw_ned_rad is None:
            return None
        roll_rad, pitch_rad = 0.0, 0.0
        if state.attitude is not None:
            roll_rad, pitch_rad = state.attitude.roll_rad, state.attitude.pitch_rad
        attitude = frames.quaternion_ned_frd_to_enu_flu(
            frames.quaternion_from_euler(roll_rad, pitch_rad, yaw_ned_rad)
        )
        # Of the two quaternions of an attitude, the one that people expect to read.
        w, x, y, z = (-part for part in attitude) if attitude[0] < 0.0 else attitude
        return MapPose(
            position_enu_m=self.enu(
                (position.latitude_deg, position.longitude_deg, position.altitude_amsl_m)
            ),
            yaw_enu_rad=frames.yaw_ned_to_enu(yaw_ned_rad),
            orientation_xyzw=(x, y, z, w),
        )

    def home_enu_m(self, state: VehicleState) -> Vector3 | None:
        """Return the launch point, or None while it or the origin is not known."""
        if self._origin is None or state.home is None:
            return None
        home = state.home
        return self.enu((home.latitude_deg, home.longitude_deg, home.altitude_amsl_m))

    def ground_enu_m(self, state: VehicleState) -> float:
        """Return the map height of the ground: home's altitude, or the origin's.

        What drives is on the ground, whatever it says of its home: an ArduRover that has found
        its place still gives a home at sea level until it is armed (observed). A home without
        a local position is from before the origin, and as wrong.
        """
        if self._origin is None:
            return 0.0
        if state.vehicle_type in _DRIVING and state.global_position is not None:
            return state.global_position.altitude_amsl_m - self._origin[2]
        if state.home is None or state.home.position_ned_m is None:
            return 0.0
        return state.home.altitude_amsl_m - self._origin[2]

    def geodetic(self, position_enu_m: Vector3) -> Geodetic:
        """Return the place of a position in the map frame; the origin must be known."""
        assert self._origin is not None
        east_m, north_m, up_m = position_enu_m
        latitude_deg, longitude_deg, _ = frames.ned_to_geodetic(
            (north_m, east_m, 0.0), self._origin
        )
        return latitude_deg, longitude_deg, self._origin[2] + up_m

    def enu(self, place: Geodetic) -> Vector3:
        """Return a place in the map frame; the origin must be known."""
        assert self._origin is not None
        latitude_deg, longitude_deg, altitude_amsl_m = place
        origin = self._origin
        north_m, east_m, _ = frames.geodetic_to_ned(
            latitude_deg, longitude_deg, altitude_amsl_m, origin
        )
        # Autopilots count local height as a difference of altitudes, without the earth's
        # curvature that the tangent plane shows (8 cm at 1 km).
        return (east_m, north_m, altitude_amsl_m - origin[2])


def _origin_from_pair(state: VehicleState) -> Geodetic | None:
    position, local = state.global_position, state.local_position
    if position is None or local is None or not state.position_valid:
        return None
    if abs(position.time_s - local.time_s) > _PAIR_AGE_S:
        return None
    north_m, east_m, down_m = local.position_ned_m
    here = (position.latitude_deg, position.longitude_deg, position.altitude_amsl_m)
    latitude_deg, longitude_deg, _ = frames.ned_to_geodetic((-north_m, -east_m, 0.0), here)
    return latitude_deg, longitude_deg, position.altitude_amsl_m + down_m
