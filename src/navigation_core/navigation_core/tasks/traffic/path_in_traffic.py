"""Flies a path among other vehicles: as fast as what is reserved allows, or around them.

At every step more of the path is reserved (:mod:`navigation_core.tasks.traffic.reservations`), and
the setpoint is only so fast that the vehicle stops within that, even if no other setpoint follows.
If it would have to wait for long, or must give way, a detour is searched for. It gives way to
intruders, which reserve nothing, in :mod:`navigation_core.tasks.traffic.giving_way`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from navigation_core.geometry import ZERO, KinematicState, norm, scale, unit
from navigation_core.limits import stopping_speed_m_s
from navigation_core.tasks.conditions import measured_state
from navigation_core.tasks.intents import Setpoint
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig
from navigation_core.tasks.leading.path_follower import PathFollower
from navigation_core.tasks.leading.pursuit import without_turn
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traffic.entries import TrafficWait
from navigation_core.tasks.traffic.flight_detours import FlightDetours, IsFree
from navigation_core.tasks.traffic.giving_way import GivingWay
from navigation_core.tasks.traffic.reserved_path import (
    REACTION_S,
    STANDS_M_S,
    ReservedPath,
    RunOut,
    Within,
)
from navigation_core.tasks.traffic.traffic_view import TrafficView
from navigation_core.tasks.traits import Traits

__all__ = ["ALONE", "BRAKE_SHARE", "PathInTraffic", "TrafficStep"]

BRAKE_SHARE = 0.6
"""Share of the maximum acceleration that is planned for the stop at the end of the reservation"""

# Up to this speed a flying vehicle is led by positions alone: without a velocity in the setpoint it
# does not fly on when setpoints end.
_BY_POSITION_M_S = 1.0


@dataclass(frozen=True)
class TrafficStep:
    """The result of a step among others.

    Attributes:
        share: the share of its speed that the setpoint may have.
        waiting: the vehicle that this one waits for, and why; None while it is not slowed down.
        is_over: whether it has waited for too long.
        leads_elsewhere: whether the path is a stop, or leads aside, so that its end is not the
            target.
    """

    share: float = 1.0
    waiting: TrafficWait | None = None
    is_over: bool = False
    leads_elsewhere: bool = False


ALONE = TrafficStep()
"""No other vehicle is near the path."""


class PathInTraffic:
    """Leads one flight along its path among others.

    Attributes:
        last: the result of the last step.
    """

    def __init__(
        self, traits: Traits, follower: PathFollower, avoidance: AvoidanceConfig | None
    ) -> None:
        """Prepare.

        Args:
            traits: what the vehicle can do.
            follower: of its path.
            avoidance: how it keeps away from obstacles; None for not at all.
        """
        self.last = ALONE
        self._traits = traits
        self._follower = follower
        self._avoidance = avoidance
        self._giving_way = GivingWay(traits, follower)
        self._detours = FlightDetours(traits, follower)
        self._path: ReservedPath | None = None
        self._run_out = RunOut(traits.setpoint_timeout_s, math.inf)
        self._allowed_m_s = self._running_m_s = math.inf
        # The stop or detour that was put in place of the path. After a replan the follower has
        # another motion, and this one no longer counts.
        self._elsewhere: Carrot | None = None
        self._stops = False
        self._waiting: TrafficWait | None = None
        # Time since which it stands and waits.
        self._stood_s: float | None = None

    def gives_way(self, observation: Observation, now: float) -> bool:
        """Leave the position where the vehicle stands, if an intruder comes and an evasion helps.

        Returns:
            Whether the follower has another path.
        """
        view = TrafficView.of(observation)
        return view is not None and self._giving_way.stand(
            view, observation, self._is_free(observation), now
        )

    def forget(self) -> None:
        """Forget the path; the vehicle does not follow it now."""
        self._giving_way.forget()
        self._detours.forget()
        self._path = self._elsewhere = None
        self._waiting, self._stood_s = None, None
        self.last = ALONE

    def step(self, observation: Observation, now: float) -> TrafficStep:
        """Reserve what is ahead, and return how the setpoint continues.

        There must be a path. It may be changed: for a detour, or for a stop; and left, once nobody
        else is known any more.
        """
        carrot = self._follower.carrot
        view = None if observation.traffic is None else TrafficView.of(observation)
        if view is None or carrot is None:
            if self._left_path or self._giving_way.evades:
                self._follower.leave_path()  # it ends elsewhere than at the target
            if self.last is not ALONE:
                self.forget()
            return self.last
        share = self._share(view, carrot, observation, now)
        waiting = self._giving_way.waiting or self._waiting
        left_path = self._left_path or self._giving_way.evades
        self.last = TrafficStep(share, waiting, self._waited_s(now) > view.timeout_s, left_path)
        return self.last

    def limited(self, setpoint: Setpoint, observation: Observation) -> Setpoint:
        """Return a setpoint that leads no further than the reservation if no other follows."""
        if self._path is None or (self._stops and self._left_path):
            return setpoint
        speed = norm(setpoint.velocity_enu_m_s)
        if self._traits.flies:
            if speed <= self._running_m_s * 1.02 or speed < STANDS_M_S:
                return setpoint
            return replace(setpoint, velocity_enu_m_s=ZERO, acceleration_enu_m_s2=ZERO)
        allowed_m_s = min(self._allowed_m_s, self._running_m_s)
        if speed <= allowed_m_s:
            return setpoint
        if allowed_m_s < STANDS_M_S:
            return without_turn(replace(setpoint, velocity_enu_m_s=ZERO), observation)
        return replace(
            setpoint, velocity_enu_m_s=scale(setpoint.velocity_enu_m_s, allowed_m_s / speed)
        )

    # --- a step --------------------------------------------------------------------------------

    @property
    def _left_path(self) -> bool:
        """Whether the path is its own stop or detour, not one that replaced it since."""
        return self._elsewhere is not None and self._elsewhere is self._follower.carrot

    def _waited_s(self, now: float) -> float:
        """Return for how long the vehicle has given way, or has stood and waited."""
        if self._giving_way.waiting is not None:
            return self._giving_way.waited_s
        if self._waiting is None or self._stood_s is None:
            return 0.0
        return now - self._stood_s

    def _share(
        self, view: TrafficView, carrot: Carrot, observation: Observation, now: float
    ) -> float:
        """Return the share of its speed that the setpoint may have."""
        here, path = measured_state(observation), self._path
        if path is not None and path.trajectory is carrot.trajectory and not self._detours.searches:
            within = path.stay(view, carrot, here.position_enu_m, now)
            if within is not None:
                return self._share_within(within, path, view, carrot, observation, now)
        self._run_out = RunOut(self._traits.setpoint_timeout_s, self._braking_m_s2(carrot))
        leads_aside = self._detours.take(view, self._run_out.braking_m_s2, now)
        carrot = self._follower.carrot or carrot
        if leads_aside is not None:
            self._elsewhere = carrot if leads_aside else None
            self._path, self._stops = None, False
        if self._left_path and carrot.ended:
            # The next path begins at the setpoint, where the vehicle stands.
            self._elsewhere = None
            self._follower.leave_path()
            return 1.0
        if self._stops and self._left_path:
            return 1.0  # it lies within the reserved part of the path before it
        path = self._path
        if path is None or path.trajectory is not carrot.trajectory:
            path = self._path = ReservedPath(carrot.trajectory, view)
        speed_m_s = self._speed_m_s(carrot, here)
        within = path.reserve(view, carrot, here.position_enu_m, speed_m_s, self._run_out, now)
        return self._share_within(within, path, view, carrot, observation, now)

    def _speed_m_s(self, carrot: Carrot, here: KinematicState) -> float:
        return norm((carrot.state if self._traits.flies else here).velocity_enu_m_s)

    def _share_within(
        self,
        within: Within,
        path: ReservedPath,
        view: TrafficView,
        carrot: Carrot,
        observation: Observation,
        now: float,
    ) -> float:
        """Return the share of its speed within what is reserved, and among intruders."""
        speed_m_s = self._speed_m_s(carrot, measured_state(observation))
        run_out, is_free = self._run_out, self._is_free(observation)
        self._waiting = within.waiting
        self._allow(within.room_m, within.aside_m, run_out)
        hardest_m_s = stopping_speed_m_s(within.room_m, 0.0, run_out.braking_m_s2 / BRAKE_SHARE)
        if self._traits.flies and speed_m_s > hardest_m_s + STANDS_M_S:
            self._follower.plan_stop(observation)
            self._path, self._elsewhere, self._stops = None, self._follower.carrot, True
            return 1.0
        if self._giving_way.waiting is None:
            is_stuck = self._waiting is not None and speed_m_s < STANDS_M_S
            self._detours.look(view, path, observation, carrot, is_free, is_stuck, now)
        share = self._share_of(carrot)
        share = self._giving_way.step(view, observation, carrot, share, is_free, now)
        if self._waiting is not None or self._giving_way.waiting is not None:
            carrot.restart_patience()
        if self._waiting is None or speed_m_s > STANDS_M_S:
            self._stood_s = None
        elif self._stood_s is None:
            self._stood_s = now
        return share

    def _allow(self, room_m: float, aside_m: float, run_out: RunOut) -> None:
        """Allow the speeds from which the vehicle stops, or runs out, within what is reserved."""
        braking_m_s2, free_m = run_out.braking_m_s2, min(room_m, aside_m)
        self._running_m_s = stopping_speed_m_s(free_m, run_out.timeout_s, braking_m_s2)
        self._allowed_m_s = min(
            stopping_speed_m_s(room_m, REACTION_S, braking_m_s2),
            max(self._running_m_s, _BY_POSITION_M_S),
        )

    def _share_of(self, carrot: Carrot) -> float:
        speed_m_s = norm(carrot.nominal.velocity_enu_m_s)
        limits = carrot.trajectory.limits
        climb_m_s = max(limits.speed_up_m_s, limits.speed_down_m_s)
        highest_m_s = math.hypot(limits.speed_horizontal_m_s, climb_m_s)
        if self._allowed_m_s >= max(speed_m_s, highest_m_s):
            self._waiting = None
            return 1.0
        ahead_m_s = norm(carrot.trajectory.sample(carrot.time_s + 0.3).velocity_enu_m_s)
        speed_m_s = max(speed_m_s, ahead_m_s, STANDS_M_S)
        if self._allowed_m_s >= 0.9 * speed_m_s:
            self._waiting = None
        if self._allowed_m_s < STANDS_M_S:
            return 0.0
        return min(self._allowed_m_s / speed_m_s, 1.0)

    def _braking_m_s2(self, carrot: Carrot) -> float:
        """Return the planned braking of a stop."""
        limit = self._follower.limits.acceleration_horizontal_m_s2
        if not self._traits.flies:
            return BRAKE_SHARE * min(limit, self._traits.braking_m_s2)
        course = unit(carrot.state.velocity_enu_m_s)
        if course is not None:
            limit = min(limit, self._follower.limits.along(course).acceleration_m_s2)
        return BRAKE_SHARE * limit

    def _is_free(self, observation: Observation) -> IsFree:
        """Return whether a line is clear of obstacles, as they are known now."""
        config = self._avoidance
        clearance_m = 0.0 if config is None else config.plan_clearance_m
        return IsFree(observation, clearance_m, config is not None)
