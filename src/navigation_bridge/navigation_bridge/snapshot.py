"""All that is known about a vehicle at one moment, made once a turn. No ROS.

Rules, tasks, admission and features of a turn read the same snapshot, and nothing else of the
vehicle. The core's :class:`Observation` is the part of it that a task needs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from mavlink_vehicle.events import LandedState
from mavlink_vehicle.positions import frames
from mavlink_vehicle.positions.frames import Geodetic, LocalFrame
from mavlink_vehicle.profiles import GENERIC, Profile
from mavlink_vehicle.state.vehicle_state import VehicleState
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.configuration.settings import BridgeConfig
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed
from navigation_bridge.vehicle.battery_watch import BatteryWatch
from navigation_bridge.vehicle.fence import PlacedAreas, fence_of, has_areas
from navigation_bridge.vehicle.map_frame import MapFrame, MapPose, ground_z_enu_m, home_z_enu_m
from navigation_bridge.vehicle.traits import limits_of, traits_of, vehicle_mode
from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacles import KnownObstacle, Obstacles
from navigation_core.safety.fences import Area, Fence
from navigation_core.safety.speed_at_bounds import Bounds
from navigation_core.searches import Searcher
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.observation import (
    MissionReport,
    Observation,
    OperationReport,
    OtherVehicles,
    VehicleMode,
)
from navigation_core.tasks.traits import Traits
from navigation_core.tasks.velocity_command import VelocityCommand

__all__ = ["LocatedSnapshot", "Observer", "PositionFault", "Snapshot"]

_AIRBORNE: dict[LandedState, bool | None] = {
    LandedState.UNDEFINED: None,
    LandedState.ON_GROUND: False,
    LandedState.TAKEOFF: True,
    LandedState.IN_AIR: True,
    LandedState.LANDING: True,
}


@dataclass(frozen=True)
class PositionFault:
    """Why a position is in doubt.

    Attributes:
        source: the report that shows it.
        reason: part of a sentence.
    """

    source: type
    reason: str


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


class Observer:
    """Makes the snapshots of one vehicle.

    Attributes:
        battery: follows the battery.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        map_frame: MapFrame,
        obstacles: ObstacleFeed,
        config: BridgeConfig,
        searcher: Searcher,
    ) -> None:
        """Prepare to look at these."""
        self._vehicle = vehicle
        self._map_frame = map_frame
        self._obstacles = obstacles
        self._config = config
        self.battery = BatteryWatch(config.safety.battery_endurance_s)
        self._searcher = searcher
        self._areas = PlacedAreas()
        self._mode: tuple[Profile | None, int, str, VehicleMode] | None = None

    @property
    def mode(self) -> VehicleMode:
        """The purpose of the vehicle's mode."""
        return self._named_mode(self._vehicle.profile, self._vehicle.state.custom_mode)[1]

    def _named_mode(self, profile: Profile | None, custom_mode: int) -> tuple[str, VehicleMode]:
        """Return the name of the vehicle's mode, and its purpose."""
        last = self._mode
        if last is None or last[0] is not profile or last[1] != custom_mode:
            name = "" if profile is None else profile.mode_name(custom_mode)
            last = self._mode = (profile, custom_mode, name, vehicle_mode(profile, name))
        return last[2], last[3]

    def configure(self, config: BridgeConfig) -> None:
        """Apply other settings."""
        self._config = config
        self.battery.configure(config.safety.battery_endurance_s)

    def look(
        self,
        now: float,
        *,
        operation: OperationReport | None = None,
        mission: MissionReport | None = None,
        fault: PositionFault | None = None,
        late_s: float = 0.0,
        taken: bool = False,
        mode_requested: bool = False,
        mode_unclear: bool = False,
        command: VelocityCommand | None = None,
        traffic: OtherVehicles | None = None,
    ) -> Snapshot:
        """Return all that is known now.

        Args:
            now: time in seconds.
            operation: state of the operation that the task has asked for last.
            mission: state of the mission that was uploaded for the goal.
            fault: why the position is in doubt for the goal.
            late_s: the worst lateness of the last seconds.
            taken: whether the vehicle is not under our control any more.
            mode_requested: whether a mode requested outside of the task is pending.
            mode_unclear: whether a request may still overtake the mode that somebody chose.
            command: the velocity command that the goal follows.
            traffic: the other vehicles.
        """
        vehicle, obstacles = self._vehicle, self._obstacles
        state, profile = vehicle.live.get(), vehicle.profile
        frame, pose = self._map_frame.frame, self._map_frame.pose(state)
        place = state.global_position
        ground_enu_m = ground_z_enu_m(state, frame)
        around, standing, heard_s = obstacles.look(), obstacles.standing, obstacles.heard_s
        items, one_way = vehicle.stored_lists.fence, vehicle.answers.one_way
        mode_name, mode = self._named_mode(profile, state.custom_mode)
        kind: type[Snapshot] = Snapshot
        velocity = position = None
        age_s = math.inf
        if place is not None and pose is not None:
            kind = LocatedSnapshot
            position, velocity = pose.position_enu_m, frames.ned_to_enu(place.velocity_ned_m_s)
            if standing.on_ground:
                # Its height is that of the ground, whatever the GPS reports.
                position = (position[0], position[1], ground_enu_m)
                velocity = (velocity[0], velocity[1], 0.0)
            sample_s = vehicle.data_age.age_s(place.time_boot_ms, state.boot_count, now) or 0.0
            age_s = max(now - place.time_s, sample_s)
        return kind(
            time_s=now,
            position_enu_m=position,
            velocity_enu_m_s=velocity,
            yaw_enu_rad=None if pose is None else pose.yaw_enu_rad,
            armed=state.armed,
            in_control=vehicle.in_control_mode,
            airborne=_AIRBORNE[state.landed_state],
            ground_enu_m=ground_enu_m,
            position_age_s=age_s,
            connected=vehicle.heartbeats.alive,
            operation=operation,
            mode=mode,
            home_enu_m=self._map_frame.home_enu_m(state),
            landing=state.landed_state is LandedState.LANDING,
            mission=mission,
            obstacles=around.obstacles,
            obstacles_seen=around.seen,
            obstacles_age_s=0.0 if heard_s is None else now - heard_s,
            obstacles_reach_m=obstacles.reach_m,
            moving=obstacles.moving,
            late_s=late_s,
            position_doubt="" if fault is None else fault.reason,
            fence=standing.fence,
            command=command,
            traffic=traffic,
            state=state,
            found=profile is not None,
            profile=profile or GENERIC,
            parameters=vehicle.parameters.values,
            frame=frame,
            pose=pose,
            mode_name=mode_name,
            one_way=one_way,
            unanswered_s=vehicle.answers.unanswered_s(now) if one_way or taken else 0.0,
            mode_unseen=vehicle.own_gap.is_open,
            mode_requested=mode_requested,
            mode_unclear=mode_unclear,
            fault=fault,
            areas=self._areas.of(items, frame, self._map_frame.enu) if items else (),
            areas_known=items is not None,
            known_obstacles=standing.known_by_name,
            sensed_obstacles=around.sensed,
            has_sensor=heard_s is not None,
            battery=self.battery,
            config=self._config,
            searcher=self._searcher,
        )

    def bounded(self, snapshot: Snapshot) -> Snapshot:
        """Return a snapshot with the limits of the flight that were set since it was made."""
        around, fence = self._obstacles.look(), self._obstacles.standing.fence
        if snapshot.fence is fence and snapshot.obstacles is around.obstacles:
            return snapshot
        return replace(
            snapshot, obstacles=around.obstacles, obstacles_seen=around.seen, fence=fence
        )
