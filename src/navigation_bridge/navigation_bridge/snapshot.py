"""All that is known about a vehicle at one moment, made once a turn. No ROS.

Rules, tasks, admission and features of a turn read the same snapshot, and nothing else of the
vehicle. The core's :class:`Observation` is the part of it that a task needs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from mavlink_vehicle.positions.frames import Geodetic, LocalFrame
from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.state.position_trust import PositionFault
from mavlink_vehicle.state.vehicle_state import VehicleState
from navigation_bridge.configuration.settings import BridgeConfig
from navigation_bridge.vehicle.battery_watch import BatteryWatch
from navigation_bridge.vehicle.fence import fence_of, has_areas
from navigation_bridge.vehicle.map_frame import MapPose, home_z_enu_m
from navigation_bridge.vehicle.traits import limits_of, traits_of
from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacles import KnownObstacle, Obstacles
from navigation_core.safety.fences import Area, Fence
from navigation_core.safety.speed_at_bounds import Bounds
from navigation_core.searches import Searcher
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traits import Traits

__all__ = ["LocatedSnapshot", "Snapshot"]


@dataclass(frozen=True, kw_only=True)
class Snapshot(Observation):
    """All that is known at one moment.

    Attributes:
        state: what the vehicle has reported.
        found: whether it was ever heard.
        profile: of its kind and firmware; ``GENERIC`` before it is found.
        parameters: the known ones of the profile's `wanted_parameters`.
        frame: its local frame; None until its origin is known.
        pose: its pose in the map frame, or None.
        mode_name: the autopilot's name of its mode; empty before it is found.
        twins: a sentence about two autopilots with its ids; empty if one has them.
        one_way: whether it is heard, but answers no longer.
        unanswered_s: for how long it has answered nothing; 0 where that is of no account.
        mode_unseen: whether the server was suspended, and the mode since then is unknown.
        mode_requested: whether a mode is pending that the server requested outside of the task.
        mode_unclear: whether a request on its way may still overtake the mode that somebody chose.
        fault: why the position is in doubt for the goal, or None.
        areas: areas of its own fence that were uploaded, as far as known.
        areas_known: whether the vehicle has reported them.
        known_obstacles: those of the configuration.
        sensed_obstacles: those that a sensor has seen.
        has_sensor: whether any obstacle sensor has reported, or is configured.
        battery: consumption of its battery, and its last report.
        config: settings for goals.
        searcher: runs the path searches.
    """

    state: VehicleState
    found: bool
    profile: Profile
    parameters: Mapping[str, float]
    frame: LocalFrame | None
    pose: MapPose | None
    mode_name: str
    twins: str
    one_way: bool
    unanswered_s: float
    mode_unseen: bool
    mode_requested: bool
    mode_unclear: bool
    fault: PositionFault | None
    areas: tuple[Area, ...]
    areas_known: bool
    known_obstacles: tuple[KnownObstacle, ...]
    sensed_obstacles: Obstacles
    has_sensor: bool
    battery: BatteryWatch
    config: BridgeConfig
    searcher: Searcher

    @cached_property
    def traits(self) -> Traits:
        """Capabilities of this vehicle, by its kind and its parameters."""
        return traits_of(self.profile, self.parameters)

    @cached_property
    def goto(self) -> GotoConfig:
        """Flight settings, with speeds capped by those of the autopilot."""
        goto = self.config.goto
        return replace(goto, limits=limits_of(self.traits, goto.limits))

    @cached_property
    def own_fence(self) -> Fence | None:
        """The vehicle's own fence by what it has reported, None while unknown."""
        if not self.found:
            return None
        return fence_of(self.profile, self.parameters, self.home_enu_m, self.areas)

    @property
    def areas_missing(self) -> bool:
        """Whether uploaded areas are in force that are not known yet."""
        return self.found and not self.areas_known and has_areas(self.profile, self.parameters)

    @property
    def bounds(self) -> Bounds:
        """The limits of every flight: the flight volume and the margin to the vehicle's fence."""
        return Bounds(self.config.volume, self.config.safety.fence_margin_m)

    @property
    def knows_obstacles(self) -> bool:
        """Whether any obstacle may be known: then what plans no path before avoids them."""
        return self.has_sensor or bool(self.known_obstacles)

    @property
    def speed_max_m_s(self) -> float:
        """Maximum requested speed; higher for a plane."""
        if not self.traits.hovers:
            return math.inf
        return min(self.config.speed_max_m_s, self.traits.speed_max_m_s)

    @property
    def home_z_enu_m(self) -> float:
        """Map height of home, from which a fence and the autopilot's altitudes count."""
        return home_z_enu_m(self.state, self.frame)

    @property
    def flies(self) -> bool:
        """Whether it reports that it is armed and in the air."""
        return self.armed and bool(self.airborne)

    @property
    def parked(self) -> bool:
        """Whether it is disarmed, and not in the air."""
        return not self.armed and not self.airborne

    @property
    def arrival_age_s(self) -> float:
        """Time since the last GLOBAL_POSITION_INT arrived; infinite without a pose."""
        position = self.state.global_position
        if position is None or self.pose is None:
            return math.inf
        return self.time_s - position.time_s


@dataclass(frozen=True, kw_only=True)
class LocatedSnapshot(Snapshot):
    """A snapshot of a vehicle whose pose is known."""

    position_enu_m: Vector3
    velocity_enu_m_s: Vector3
    yaw_enu_rad: float
    frame: LocalFrame
    pose: MapPose

    def enu(self, place: Geodetic) -> Vector3:
        """Return the map position of a geodetic position."""
        return self.frame.enu_m(place)
