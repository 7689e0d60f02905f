"""Frames of a recorded track: the server's map frame, or one without its origin."""

from __future__ import annotations

from typing import Protocol

from mavlink_vehicle.positions import frames
from mavlink_vehicle.positions.projections import Geodetic, LocalFrame, true_to_scale
from mavlink_vehicle.profiles import profile_for
from mavlink_vehicle.state.reducer import VehicleState
from navigation_bridge.vehicle.map_frame import MapPose
from navigation_core.geometry import Vector3


class PoseFrame(Protocol):
    """Converts telemetry into poses, like the map frame."""

    def update(self, state: VehicleState) -> None:
        """Update from a new state."""

    def pose(self, state: VehicleState) -> MapPose | None:
        """Return the pose, or None while unknown."""


class FromFirstPosition:
    """Frame of a recording without a map origin."""

    def __init__(self) -> None:
        """Start without an origin."""
        self._origin: Geodetic | None = None

    def update(self, state: VehicleState) -> None:
        """Take the first position as the origin."""
        place = state.global_position
        if self._origin is None and place is not None:
            self._origin = (place.latitude_deg, place.longitude_deg, place.altitude_amsl_m)

    def pose(self, state: VehicleState) -> MapPose | None:
        """Return the pose, or None before the first position."""
        place, origin = state.global_position, self._origin
        if place is None or origin is None:
            return None
        profile = profile_for(state.autopilot, state.vehicle_type)
        frame = LocalFrame(origin, profile.projection or true_to_scale(origin[0]))
        here = (place.latitude_deg, place.longitude_deg, place.altitude_amsl_m)
        return _facing(state, frames.ned_to_enu(frame.ned_m(here)))


class LocalOnly:
    """Frame of a recording without a global position."""

    def update(self, state: VehicleState) -> None:
        """Do nothing: the local frame needs no origin."""

    def pose(self, state: VehicleState) -> MapPose | None:
        """Return the pose in the vehicle's own local frame, or None before there is one."""
        place = state.local_position
        return None if place is None else _facing(state, frames.ned_to_enu(place.position_ned_m))


def _facing(state: VehicleState, position_enu_m: Vector3) -> MapPose:
    yaw_ned_rad = 0.0 if state.attitude is None else state.attitude.yaw_ned_rad
    yaw_enu_rad = frames.yaw_ned_to_enu(yaw_ned_rad)
    w, x, y, z = frames.quaternion_from_yaw(yaw_enu_rad)
    return MapPose(position_enu_m, yaw_enu_rad, (x, y, z, w))
