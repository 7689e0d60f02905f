"""Admitted goals, and the situation that admission checks. No ROS."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from mavlink_vehicle.events import LandedState
from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.configuration.settings import BridgeConfig
from navigation_bridge.goals.straight_legs import FlightPlan
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed
from navigation_bridge.vehicle.map_frame import MapFrame, MapPose
from navigation_bridge.vehicle.traits import limits_of, traits_of
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.room import Bounds
from navigation_core.safety.target_checks import Rejection
from navigation_core.searches import Searcher
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Handover
from navigation_core.tasks.task import Task
from navigation_core.tasks.traits import Traits

__all__ = ["Admitted", "Situation"]


@dataclass(frozen=True)
class Admitted:
    """An admitted request.

    Attributes:
        description: description of the goal for the log.
        target_enu_m: final target in the map frame; None if the vehicle decides it.
        make_task: makes the task, which continues from a replaced goal's last setpoint.
        warnings: sentences for the log and the final message.
        plan: the straight legs that are flown; None if the vehicle decides.
    """

    description: str
    target_enu_m: Vector3 | None
    make_task: Callable[[Handover], Task]
    warnings: tuple[str, ...] = ()
    plan: FlightPlan | None = None


@dataclass(frozen=True)
class Situation:
    """Input of admission, gathered once.

    Attributes:
        vehicle: the vehicle, which is connected and has a profile.
        profile: that profile.
        map_frame: its map frame.
        pose: its pose in it; None only for goals that need no position.
        position_age_s: age of that pose; above ``position_stale_s`` only for goals that need no
            position, and infinite without one.
        config: settings for goals.
        obstacles: known and sensed obstacles.
        searcher: runs the path searches.
    """

    vehicle: Vehicle
    profile: Profile
    map_frame: MapFrame
    pose: MapPose | None
    position_age_s: float
    config: BridgeConfig
    obstacles: ObstacleFeed
    searcher: Searcher

    @property
    def traits(self) -> Traits:
        """Capabilities of this vehicle, by its kind and its parameters."""
        return traits_of(self.profile, self.vehicle.parameters)

    @property
    def goto(self) -> GotoConfig:
        """Flight settings, with speeds capped by those of the autopilot."""
        goto = self.config.goto
        return replace(goto, limits=limits_of(self.traits, goto.limits))

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
    def ground_enu_m(self) -> float:
        """Height of the ground in the map frame."""
        return self.map_frame.ground_enu_m(self.vehicle.state)

    @property
    def flies(self) -> bool:
        """Whether it reports that it is armed and in the air."""
        state = self.vehicle.state
        return state.armed and state.landed_state not in (
            LandedState.ON_GROUND,
            LandedState.UNDEFINED,
        )

    def may_move(self) -> Rejection | None:
        """Return the reason why a goal may not start the vehicle, or None."""
        goto = self.config.goto
        if not self.vehicle.state.armed and not goto.may_arm:
            word = "pilot" if goto.may_take_off else "never"
            by_hand = "arm and take off" if self.traits.flies and word == "never" else "arm it"
            return Rejection(
                OutcomeCode.ARMING_NOT_ALLOWED,
                f"The vehicle is disarmed and parameter arming is '{word}'; {by_hand} "
                "yourself, or set arming to 'auto'.",
            )
        if self.traits.flies and not self.flies and not goto.may_leave_ground:
            told = self.vehicle.state.landed_state is LandedState.ON_GROUND
            where = "is on the ground" if told else "does not report that it is airborne"
            return Rejection(
                OutcomeCode.TAKEOFF_NOT_ALLOWED,
                f"The vehicle {where} and parameter arming is 'never'; take off yourself, or "
                "set arming to 'pilot', so that goals take off once the vehicle is armed.",
            )
        return None
