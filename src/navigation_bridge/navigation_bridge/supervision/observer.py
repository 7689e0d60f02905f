"""Looks at one vehicle: what is known of it, how late that is, whether to trust it. No ROS.

Lateness is that of the server's setpoints, too. :mod:`mavlink_vehicle.state.position_trust` defines
the signs of a position in doubt, :mod:`navigation_bridge.rules.goal_rules` the effect on a goal.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

from mavlink_vehicle.events import LandedState
from mavlink_vehicle.positions import frames
from mavlink_vehicle.profiles import GENERIC, Profile
from mavlink_vehicle.state.position_trust import JUMP_MAX_M, PositionFault, PositionTrust
from mavlink_vehicle.state.telemetry import GlobalPosition
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.configuration.settings import BridgeConfig
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed
from navigation_bridge.reporting import Reporter
from navigation_bridge.snapshot import LocatedSnapshot, Snapshot
from navigation_bridge.vehicle.battery_watch import BatteryWatch
from navigation_bridge.vehicle.fence import PlacedAreas
from navigation_bridge.vehicle.map_frame import MapFrame, ground_z_enu_m
from navigation_bridge.vehicle.traits import vehicle_mode
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.late_setpoints import LATE_S, TOO_LATE_S, WINDOW_S
from navigation_core.searches import Searcher
from navigation_core.tasks.inputs.tracked_target import TrackedTarget
from navigation_core.tasks.inputs.velocity_command import VelocityCommand
from navigation_core.tasks.inputs.waypoint_acts import ActReport
from navigation_core.tasks.intents import Outcome
from navigation_core.tasks.observation import (
    MissionReport,
    OperationReport,
    OtherVehicles,
    VehicleMode,
)
from navigation_core.trajectories.timed_trajectory import TimedTrajectory

__all__ = ["LatenessWatch", "Observer", "judged", "position_fault"]

_AIRBORNE: dict[LandedState, bool | None] = {
    LandedState.UNDEFINED: None,
    LandedState.ON_GROUND: False,
    LandedState.TAKEOFF: True,
    LandedState.IN_AIR: True,
    LandedState.LANDING: True,
}
# The ends that a vehicle that was slowed down or not listened to may come to.
_BY_LATENESS = frozenset({OutcomeCode.NO_POSITION, OutcomeCode.TIMEOUT})
# Minimum interval of warnings about a late loop.
_WARNING_INTERVAL_S = 2.0


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
        act: ActReport | None = None,
        mission: MissionReport | None = None,
        fault: PositionFault | None = None,
        late_s: float = 0.0,
        taken: bool = False,
        mode_requested: bool = False,
        mode_unclear: bool = False,
        command: VelocityCommand | None = None,
        followed: TrackedTarget | None = None,
        trajectory: TimedTrajectory | None = None,
        traffic: OtherVehicles | None = None,
    ) -> Snapshot:
        """Return all that is known now.

        Args:
            now: time in seconds.
            operation: state of the operation that the task has asked for last.
            act: the end of the act that it has asked for last.
            mission: state of the mission that was uploaded for the goal.
            fault: why the position is in doubt for the goal.
            late_s: the worst lateness of the last seconds.
            taken: whether the vehicle is not under our control any more.
            mode_requested: whether a mode requested outside of the task is pending.
            mode_unclear: whether a request may still overtake the mode that somebody chose.
            command: the velocity command that the goal follows.
            followed: the target that the goal follows.
            trajectory: the last trajectory of a client that the goal flies.
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
            sample_s = vehicle.data_age.age_s(place.time_boot_ms, state.clock_count, now) or 0.0
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
            act=act,
            mode=mode,
            home_enu_m=self._map_frame.home_enu_m(state),
            landing=state.landed_state is LandedState.LANDING,
            mission=mission,
            obstacles=around.obstacles,
            obstacles_seen=around.seen,
            obstacles_age_s=0.0 if heard_s is None else now - heard_s,
            obstacles_reach_m=obstacles.reach_m,
            moving=obstacles.moving,
            corners_enu_m=obstacles.corners_enu_m,
            late_s=late_s,
            position_doubt="" if fault is None else fault.reason,
            fence=standing.fence,
            command=command,
            followed=followed,
            trajectory=trajectory,
            traffic=traffic,
            state=state,
            found=profile is not None,
            profile=profile or GENERIC,
            parameters=vehicle.parameters.values,
            frame=frame,
            pose=pose,
            mode_name=mode_name,
            twins=vehicle.twins.reason,
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


class LatenessWatch:
    """Remembers how late the steps of goals were, and the data that they used.

    Attributes:
        count: how many delays of LATE_S or more there were.
        worst_s: the greatest delay ever.
        data_age_s: age of the vehicle's data when it was last read in a goal; None while unknown.
    """

    def __init__(self, vehicle: Vehicle, report: Reporter) -> None:
        """Begin without a delay."""
        self._vehicle = vehicle
        self._report = report
        self.count = 0
        self.worst_s = 0.0
        self.data_age_s: float | None = None
        # Falling delays with their times: the first is the worst of those that still count.
        self._delays: deque[tuple[float, float]] = deque()
        self._data_time_ms: int | None = None
        self._warned_s = -math.inf

    def recent_s(self, now: float) -> float:
        """Return the worst delay of the last WINDOW_S seconds."""
        while self._delays and now - self._delays[0][0] > WINDOW_S:
            self._delays.popleft()
        return self._delays[0][1] if self._delays else 0.0

    def note_step(self, late_s: float, now: float) -> None:
        """Note a step that was due some time ago, and the age of the data that it uses."""
        if self._note(late_s, now):
            self._warn(
                f"The control loop is {late_s:.2f} s late; the vehicle is slowed down, and stopped "
                f"from {TOO_LATE_S:g} s on. Reduce the load on this machine.",
                now,
            )
        # Data that is old when it is read counts as lateness: the vehicle is elsewhere by now.
        vehicle, time_ms = self._vehicle, self._vehicle.live.boot_time_ms
        if time_ms == self._data_time_ms:
            return  # nothing came: that is for the rules about the link
        self._data_time_ms = time_ms
        self.data_age_s = vehicle.data_age.age_s(time_ms, vehicle.live.known.clock_count, now)
        age_s = self.data_age_s or 0.0
        if self._note(age_s, now):
            self._warn(
                f"The vehicle's data is {age_s:.2f} s old when it is read; the vehicle is slowed "
                f"down, and stopped from {TOO_LATE_S:g} s on. Reduce the load on this machine, or "
                "check the link.",
                now,
            )

    def _note(self, late_s: float, now: float) -> bool:
        """Record a delay; return whether it was a long one."""
        while self._delays and self._delays[-1][1] <= late_s:
            self._delays.pop()
        self._delays.append((now, late_s))
        self.worst_s = max(self.worst_s, late_s)
        if late_s < LATE_S:
            return False
        self.count += 1
        return True

    def _warn(self, text: str, now: float) -> None:
        if now - self._warned_s >= _WARNING_INTERVAL_S:
            self._warned_s = now
            self._report.log(LogLevel.WARN, text)


def judged(outcome: Outcome, snapshot: Snapshot) -> Outcome:
    """Return a task's outcome as what it was observed by allows.

    The server's own lateness is its reason if it is one, and reports that contradict each other
    show no success.
    """
    late_s, fault = snapshot.late_s, snapshot.fault
    if outcome.code is OutcomeCode.SUCCESS and fault is not None and fault.is_contradiction:
        text = f"{outcome.message} That is in doubt: {fault.reason}."
        return replace(outcome, code=OutcomeCode.NO_POSITION, message=text)
    if late_s < TOO_LATE_S or outcome.code not in _BY_LATENESS:
        return outcome
    text = f"{outcome.message} This server was {late_s:.1f} s late itself."
    return replace(outcome, code=OutcomeCode.SERVER_LATE, message=text)


def position_fault(trust: PositionTrust, jumps_ned_m: tuple[float, float]) -> PositionFault | None:
    """Return why the position is in doubt for a goal that began after some jumps, or None."""
    if trust.fault is not None and trust.fault.is_contradiction:
        return trust.fault
    if trust.jump_ned_m != jumps_ned_m:
        jump_m = trust.jump_m(jumps_ned_m)
        if jump_m > JUMP_MAX_M:
            reason = f"the position has jumped by {jump_m:.1f} m"
            return PositionFault(GlobalPosition, reason)
    return trust.fault
