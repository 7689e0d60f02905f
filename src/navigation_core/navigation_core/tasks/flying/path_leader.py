"""Leads the vehicle along its path: by a setpoint that moves on, or by a velocity."""

from __future__ import annotations

import math
from dataclasses import replace

from navigation_core.tasks.conditions import Located
from navigation_core.tasks.flying.itinerary import Itinerary
from navigation_core.tasks.intents import Fly, Setpoint
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.driven_path import DrivenPath
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.leading.path_follower import PathFollower
from navigation_core.tasks.leading.pursuit import Pursuit
from navigation_core.tasks.leading.run_out_limiter import RunOutLimiter
from navigation_core.tasks.leading.turning_circle import Pursuer
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traffic.path_in_traffic import ALONE, PathInTraffic, TrafficStep

__all__ = ["PathLeader"]


class PathLeader:
    """Makes the setpoints of one flight.

    Attributes:
        in_traffic: leads it among other vehicles.
    """

    def __init__(self, terms: FlightTerms, follower: PathFollower) -> None:
        """Prepare; the follower must have been made with the same terms."""
        self._traits = terms.traits
        self._follower = follower
        self._run_out_limiter = RunOutLimiter(
            terms.avoidance, terms.traits, follower.limits, terms.bounds
        )
        self._pursuit = Pursuit(terms.traits)
        self.in_traffic = PathInTraffic(terms.traits, follower, terms.avoidance)

    def among_others(self, observation: Observation, now: float) -> TrafficStep:
        """Reserve what is ahead, where there is anybody to keep apart from."""
        is_alone = observation.traffic is None and self.in_traffic.last is ALONE
        return ALONE if is_alone else self.in_traffic.step(observation, now)

    def restart(self) -> None:
        """Begin again: something else has led the vehicle meanwhile."""
        self._pursuit.forget()

    def walk(
        self,
        carrot: Carrot,
        here: Located,
        itinerary: Itinerary,
        observation: Observation,
        share: float,
    ) -> DrivenPath | None:
        """Move the setpoint on at a share of its speed; return the path ahead of what drives."""
        here_enu_m = here.state.position_enu_m
        path = None
        if self._traits.flies:
            share = min(share, self._run_out_limiter.speed_share(carrot, observation))
            self._follower.walk(here_enu_m, share)
        else:
            meet = itinerary.point_to_meet()
            until_s = math.inf if meet is None else self._follower.passed_at_s(meet)
            path = self._follower.follow(here_enu_m, until_s)
        passed = self._follower.passed
        leaves = not self._traits.flies and self._pursuit.leaves
        if itinerary.note_place(observation.position_enu_m, passed, leaves):
            self._follower.sent.outdate()  # so it is replanned, from here to the same point
        return path

    def setpoint(
        self,
        carrot: Carrot,
        here: Located,
        radius_m: float,
        observation: Observation,
        path: DrivenPath | None = None,
    ) -> Setpoint:
        """Return what leads the vehicle along: the carrot, or a velocity along the path.

        Args:
            carrot: the setpoint on the path.
            here: where the vehicle is.
            radius_m: how near to the end of the path counts as arrived.
            observation: what is known.
            path: what is left of the path of what drives; None once it is at its end.
        """
        if self._traits.flies:
            return carrot.setpoint
        return self._pursuit.follow(
            path,
            carrot.trajectory.end_position_enu_m,
            Pursuer(here.state.position_enu_m, here.velocity_enu_m_s, here.yaw_enu_rad),
            self._follower.limits,
            radius_m,
            observation.time_s,
        )

    def limited(self, fly: Fly, observation: Observation, is_led: bool) -> Fly:
        """Return what is sent, so that it is safe if no other setpoint follows.

        Args:
            fly: what is wanted.
            observation: what is known.
            is_led: whether the vehicle follows its path.
        """
        if self._follower.carrot is not None:
            self._follower.sent.note(self._follower.carrot)
        setpoint = self._run_out_limiter.limited(fly.setpoint, observation)
        if not is_led:
            self.in_traffic.forget()
            return replace(fly, setpoint=setpoint)
        if self.in_traffic.last is ALONE:
            return replace(fly, setpoint=setpoint)
        slower = self.in_traffic.limited(setpoint, observation)
        if slower is not setpoint:
            self._pursuit.hold_back()
        return replace(fly, setpoint=slower)
