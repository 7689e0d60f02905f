"""Follows a target: keeps a place beside it, holds while it is lost, ends when it stays lost.

It neither arms nor takes off. What is known of the target comes with each observation.
"""

from __future__ import annotations

import math

from navigation_core.geometry import Vector3, add, scale
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.conditions import Located
from navigation_core.tasks.inputs.tracked_target import TrackedTarget
from navigation_core.tasks.inputs.velocity_command import VelocityCommand, VelocityFrame
from navigation_core.tasks.intents import Outcome
from navigation_core.tasks.leading.path_follower import cruise_limits
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.progress import FollowProgress, FollowState, Progress, Status
from navigation_core.tasks.steering.path_around import PathAround
from navigation_core.tasks.steering.steered_task import SteeredTask
from navigation_core.tasks.steering.steersman import VelocityTerms
from navigation_core.tasks.steering.target_guide import FollowTerms, TargetGuide

__all__ = ["FollowTarget"]

# The way is kept free for where the place will be after this time.
_AHEAD_S = 1.5
# Room to the bounds of the volume, at which the vehicle would stop instead of flying beside them.
_ROOM_M = 1.0


class FollowTarget(SteeredTask):
    """The task. See :class:`navigation_core.tasks.task.Task`."""

    never_starts = "following neither arms nor takes off"

    def __init__(self, terms: VelocityTerms, following: FollowTerms) -> None:
        """Prepare.

        Args:
            terms: how the vehicle is steered.
            following: how it follows.
        """
        super().__init__(terms)
        flight = terms.flight
        limits = cruise_limits(flight.config.limits, terms.max_speed_m_s, flight.traits)
        self._following = following
        self._guide = TargetGuide(following, flight.traits, limits)
        self._path = PathAround(flight.avoidance, flight.traits)
        self._volume = terms.volume
        self._began_s = self._since_s = 0.0

    @property
    def path_enu_m(self) -> tuple[Vector3, ...]:
        """The path around obstacles, while there is one."""
        return self._path.path_enu_m

    def start(self, observation: Observation, now: float) -> None:
        """Begin."""
        super().start(observation, now)
        self._began_s = now

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the status, and how the target is followed."""
        progress = super().progress(observation, now)
        target = observation.followed or TrackedTarget()
        state = FollowState.FOLLOWING
        if target.is_lost(now):
            state = FollowState.LOST if target.is_known else FollowState.ACQUIRING
        gap_m = math.nan
        place = target.position_at(now) if target.is_known else None
        if place is not None and observation.position_enu_m is not None:
            gap_m = self._guide.gap_m(observation.position_enu_m, place)
        follow = FollowProgress(state, gap_m, target.age_s(now), place)
        blocked, status = progress.blocked, progress.status
        if status is Status.NAVIGATING and self._path.blocked:
            status, blocked = Status.BLOCKED, self._path.blocked
        return Progress(
            status, 0.0, 0.0, replans=self._path.replans, blocked=blocked, follow=follow
        )

    # --- what steers it ---------------------------------------------------------------

    def _begin_again(self, now: float) -> None:
        self._since_s = now
        self._path.forget()

    def _wanted(
        self, here: Located, observation: Observation, now: float
    ) -> VelocityCommand | Outcome | None:
        target = observation.followed or TrackedTarget()
        is_lost, lasted_s = target.is_lost(now), now - self._began_s
        if lasted_s > self._following.max_duration_s and not is_lost:
            text = f"The target was followed for {self._following.max_duration_s:g} s."
            return Outcome(OutcomeCode.SUCCESS, text, None)
        if not is_lost:
            return self._command(target, here, observation, now)
        self._path.forget()
        timeout_s = self._following.lost_timeout_s
        if now - max(self._since_s, target.measured_s) <= timeout_s:
            return None
        return Outcome(OutcomeCode.TARGET_LOST, _lost_text(target, timeout_s), None)

    def _command(
        self, target: TrackedTarget, here: Located, observation: Observation, now: float
    ) -> VelocityCommand:
        """Return the velocity that follows a target whose place is known."""
        guide, position = self._guide, here.state.position_enu_m
        centre, speed = target.position_at(now), target.velocity_enu_m_s
        place = self._inside(self._following.place(target, centre), observation)
        ahead = self._inside(add(place, scale(speed, _AHEAD_S)), observation)
        corner = self._path.corner(position, ahead, observation)
        if corner is ahead:
            wanted = guide.velocity(position, place, target, now)
        elif corner is None:
            wanted = (0.0, 0.0, 0.0)
        else:
            wanted = guide.towards(position, corner)
        yaw = here.yaw_enu_rad
        wanted = guide.kept_off(wanted, position, yaw, target, now)
        rate = guide.yaw_rate_rad_s(position, yaw, wanted, centre)
        return VelocityCommand(now, VelocityFrame.MAP, wanted, rate)

    def _inside(self, place_enu_m: Vector3, observation: Observation) -> Vector3:
        """Return the nearest place inside the flight volume's radius and heights."""
        return self._volume.nearest(place_enu_m, observation.ground_enu_m, _ROOM_M)


def _lost_text(target: TrackedTarget, timeout_s: float) -> str:
    why = f" The last of {target.rejected} rejected samples: {target.fault}" if target.fault else ""
    if not target.is_known:
        return f"No usable sample of the target came within {timeout_s:g} s.{why}"
    return f"No usable sample of the target has come for {timeout_s:g} s.{why}"
