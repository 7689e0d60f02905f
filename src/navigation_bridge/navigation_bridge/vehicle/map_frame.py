"""The map frame: the vehicle's local (EKF) frame with the axes of ROS, east, north, up. No ROS."""

from __future__ import annotations

from dataclasses import dataclass

from mavlink_vehicle.positions import frames
from mavlink_vehicle.positions.frame_finder import PAIR_AGE_S, FrameFinder
from mavlink_vehicle.positions.frames import Geodetic, LocalFrame
from mavlink_vehicle.profiles import profile_for
from mavlink_vehicle.state.reducer import VehicleState
from mavlink_vehicle.state.telemetry import GlobalPosition, Home, Origin
from navigation_core.geometry import Vector3

# MAV_TYPE_GROUND_ROVER and MAV_TYPE_SURFACE_BOAT (minimal.xml).
_DRIVING = frozenset({10, 11})


@dataclass(frozen=True)
class MapPose:
    """Pose of the vehicle: ENU metres from the map origin, yaw ENU in radians."""

    position_enu_m: Vector3
    yaw_enu_rad: float
    orientation_xyzw: tuple[float, float, float, float]


class MapFrame:
    """Finds the vehicle's local frame and converts its telemetry into the map frame.

    The origin is that of the autopilot (GPS_GLOBAL_ORIGIN). If it is not reported, it is computed
    from a pair of GLOBAL_POSITION_INT and LOCAL_POSITION_NED, and kept until the autopilot
    restarts, so that the frame does not drift. Geodetic positions are converted by the firmware's
    own projection.

    Attributes:
        frame: the vehicle's local frame, None until its origin is known.
    """

    def __init__(self) -> None:
        """Start without an origin."""
        self._finder = FrameFinder(None)
        self._vehicle: tuple[int, int] | None = None
        self._taken: Origin | None = None
        self.frame: LocalFrame | None = None
        self._posed: tuple[VehicleState, LocalFrame | None, MapPose | None] | None = None
        self._home: tuple[Home, LocalFrame, Vector3] | None = None

    @property
    def origin(self) -> Geodetic | None:
        """Latitude, longitude and altitude (above mean sea level) of the map origin."""
        return None if self.frame is None else self.frame.origin

    @property
    def wants_pairs(self) -> bool:
        """Whether the frame can still learn from positions."""
        return self._finder.wants_pairs

    def update(self, state: VehicleState) -> None:
        """Update from a new state; reset if the autopilot restarted or is identified."""
        vehicle = state.boot_count, state.autopilot
        if vehicle != self._vehicle:
            self._vehicle = vehicle
            self._taken = None
            self._finder = FrameFinder(profile_for(state.autopilot, state.vehicle_type).projection)
        origin = state.origin
        if origin is not None and origin is not self._taken:
            self._taken = origin
            self._finder.take_origin(
                (origin.latitude_deg, origin.longitude_deg, origin.altitude_amsl_m)
            )
        if self._finder.wants_pairs:
            self._take_pair(state)
        self.frame = self._finder.frame

    def _take_pair(self, state: VehicleState) -> None:
        place, local = state.global_position, state.local_position
        if place is None or local is None or not state.position_valid:
            return
        later_s = 1e-3 * (place.time_boot_ms - local.time_boot_ms)
        if max(abs(later_s), abs(place.time_s - local.time_s)) > PAIR_AGE_S:
            return
        (north_m, east_m, down_m), velocity = local.position_ned_m, local.velocity_ned_m_s
        moved = (
            north_m + later_s * velocity[0],
            east_m + later_s * velocity[1],
            down_m + later_s * velocity[2],
        )
        self._finder.pair((place.latitude_deg, place.longitude_deg, place.altitude_amsl_m), moved)

    def pose(self, state: VehicleState) -> MapPose | None:
        """Return the pose, or None while there is no valid position, origin or heading."""
        posed, frame = self._posed, self.frame
        if posed is None or posed[0] is not state or posed[1] is not frame:
            pose = None
            if frame is not None and (found := state.pose_enu(frame)) is not None:
                position_enu_m, yaw_enu_rad, (w, x, y, z) = found
                pose = MapPose(position_enu_m, yaw_enu_rad, (x, y, z, w))
            posed = self._posed = (state, frame, pose)
        return posed[2]

    def home_enu_m(self, state: VehicleState) -> Vector3 | None:
        """Return the launch point, or None while it or the origin is unknown."""
        home, frame, known = state.home, self.frame, self._home
        if frame is None or home is None:
            return None
        if known is None or known[0] is not home or known[1] is not frame:
            place = (home.latitude_deg, home.longitude_deg, home.altitude_amsl_m)
            known = self._home = (home, frame, self.enu(place))
        return known[2]

    def ground_enu_m(self, state: VehicleState) -> float:
        """Return the map height of the ground (`ground_z_enu_m`)."""
        return ground_z_enu_m(state, self.frame)

    def home_z_enu_m(self, state: VehicleState) -> float:
        """Return the map height of home (`home_z_enu_m`)."""
        return home_z_enu_m(state, self.frame)

    def geodetic(self, position_enu_m: Vector3) -> Geodetic:
        """Return the geodetic position of a map position; the origin must be known."""
        assert self.frame is not None
        return self.frame.geodetic(frames.enu_to_ned(position_enu_m))

    def enu(self, place: Geodetic) -> Vector3:
        """Return the map position of a geodetic position; the origin must be known."""
        assert self.frame is not None
        return self.frame.enu_m(place)


def ground_z_enu_m(state: VehicleState, frame: LocalFrame | None) -> float:
    """Return the map height of the ground: where the vehicle last stood, disarmed.

    Before it has been seen there it is that of home. A rover or boat is on the ground.
    """
    if frame is None:
        return 0.0
    altitude_amsl_m = state.ground_altitude_amsl_m
    if state.vehicle_type in _DRIVING and state.global_position is not None:
        altitude_amsl_m = state.global_position.altitude_amsl_m
    if altitude_amsl_m is None:
        return home_z_enu_m(state, frame)
    return altitude_amsl_m - frame.origin[2]


def home_z_enu_m(state: VehicleState, frame: LocalFrame | None) -> float:
    """Return the map height of home, from which a fence and the autopilot's altitudes count.

    Home may be above or below where the vehicle stands (DO_SET_HOME). An ArduRover with a valid
    position reports a home at sea level until it is armed (observed), so that of a rover or
    boat is the ground. A home without a local position is older than the origin, and as wrong.
    """
    if frame is None:
        return 0.0
    if state.vehicle_type in _DRIVING and state.global_position is not None:
        return ground_z_enu_m(state, frame)
    if state.home is None or state.home.position_ned_m is None:
        return 0.0
    return state.home.altitude_amsl_m - frame.origin[2]


def still_has_pose(state: VehicleState, here: GlobalPosition | None) -> bool:
    """Return whether a vehicle that had a pose surely has one at a newer position.

    Args:
        state: the state before the newest measurements, none of which is missing its numbers.
        here: the newer position.
    """
    estimator = state.estimator
    return (
        here is not None
        and state.local_position is not None
        and (state.attitude is not None or here.heading_ned_rad is not None)
        and (
            not state.estimator_reported if estimator is None else estimator.horizontal_position_ok
        )
    )
