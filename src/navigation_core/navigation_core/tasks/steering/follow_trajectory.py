"""Flies trajectories of other programs: the goal's, and those that replace it.

It neither arms nor takes off. A trajectory that replaces another is joined from the setpoint sent
last. One that ends in motion is followed by a brake, after which another may come until the goal
times out. Paused, cancelled or blocked, the vehicle stops on its trajectory.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from navigation_core.geometry import KinematicState, Vector3, distance
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.conditions import Dwell, Located, located, measured_speed
from navigation_core.tasks.intents import Intent, Outcome, StopFirst
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.phased_task import Answer
from navigation_core.tasks.phases import STOPPING, Phase
from navigation_core.tasks.progress import Progress, Status, TrajectoryProgress
from navigation_core.tasks.steering.steered_task import SteeredTask
from navigation_core.tasks.steering.steersman import VelocityTerms
from navigation_core.tasks.steering.trajectory_leader import TrajectoryLeader
from navigation_core.trajectories.timed_trajectory import TimedTrajectory

__all__ = ["FollowTrajectory", "TrajectoryTerms"]


@dataclass(frozen=True)
class TrajectoryTerms:
    """How to fly trajectories.

    Attributes:
        steering: settings, traits, obstacles, bounds, and what a replaced task sent last.
        first: the goal's own trajectory; None for those of the topic only.
    """

    steering: VelocityTerms
    first: TimedTrajectory | None


class FollowTrajectory(SteeredTask):
    """The task. See :class:`navigation_core.tasks.task.Task`."""

    never_starts = "a trajectory neither arms nor takes off"

    def __init__(self, terms: TrajectoryTerms) -> None:
        """Prepare."""
        super().__init__(terms.steering)
        flight = terms.steering.flight
        self._leader = TrajectoryLeader(flight, flight.config.limits)
        self._next = self._seen = terms.first
        self._arrived = Dwell(flight.config.arrival_dwell_s)
        self._since_s = 0.0
        self._replacements = 0
        self._path: tuple[Vector3, ...] = ()
        self._patience_s = flight.config.settle_timeout_s
        avoidance = flight.avoidance
        self._blocked_s = self._patience_s if avoidance is None else avoidance.blocked_timeout_s

    # --- the task protocol -----------------------------------------------------------

    @property
    def commanded(self) -> KinematicState | None:
        """State of the setpoint sent last, for a successor; None before the first."""
        carrot = self._leader.carrot
        return super().commanded if carrot is None else carrot.state

    @property
    def commanded_yaw_enu_rad(self) -> float | None:
        """Yaw of the setpoint sent last; None before the first."""
        carrot = self._leader.carrot
        return super().commanded_yaw_enu_rad if carrot is None else carrot.yaw_enu_rad

    @property
    def path_enu_m(self) -> tuple[Vector3, ...]:
        """Points along the trajectory that is flown."""
        return self._path

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the status, and how the trajectory is flown."""
        leader, status = self._leader, self._status
        carrot, blocked = leader.carrot, ""
        if status is Status.BLOCKED:
            blocked = leader.room.reason
        flown = TrajectoryProgress(
            math.nan if carrot is None else leader.error_m,
            0.0 if carrot is None else carrot.rate,
            leader.limited_by,
            self._replacements,
        )
        left_m = 0.0 if carrot is None else carrot.distance_remaining_m
        left_s = 0.0 if carrot is None else carrot.time_remaining_s
        return Progress(status, left_m, left_s, blocked=blocked, trajectory=flown)

    # --- what leads it ----------------------------------------------------------------

    def _begin_again(self, now: float) -> None:
        self._since_s = now
        if self._leader.carrot is not None:
            self._leader.carrot.restart_patience()

    def _forget_sent(self) -> None:
        super()._forget_sent()
        self._leader.forget()

    def _follow(self, observation: Observation, now: float) -> Answer:
        here = located(observation, self._config.position_stale_s)
        if here is None or observation.position_doubt:
            return Phase.HOLDING
        if observation.trajectory is not None and observation.trajectory is not self._seen:
            self._next = self._seen = observation.trajectory
        self._take_next(here, now)
        if self._pause_asked:
            self._status = Status.PAUSED
            self._begin_again(now)
            return self._stand(here, observation)
        answer = self._leader.lead(here, observation, self._dt_s, stops=False)
        if answer is None:
            self._status = Status.HOLDING
            if now - self._since_s > self._patience_s:
                return StopFirst(self._silence())
            return self._lead(here, observation, None, now)
        ended = self._ended(here, observation, now)
        return answer if ended is None else StopFirst(ended)

    def _stand(self, here: Located, observation: Observation) -> Intent:
        answer = self._leader.lead(here, observation, self._dt_s, stops=True)
        return super()._stand(here, observation) if answer is None else answer

    def _take_next(self, here: Located, now: float) -> None:
        """Join the trajectory that is next, once it begins; or the flown one again."""
        leader, timed = self._leader, self._next
        begins = timed is not None and timed.begun_s(now) >= 0.0
        if timed is not None and begins:
            from_s = timed.begun_s(now)
        elif leader.carrot is None and leader.timed is not None and self._phase not in STOPPING:
            timed, from_s = leader.timed, leader.left_at_s
        else:
            return
        start, yaw = self.commanded, self.commanded_yaw_enu_rad
        if start is None or yaw is None or not self._is_near(start, here):
            start, yaw = here.state, here.yaw_enu_rad
        replaces = begins and leader.timed is not None
        if begins:
            self._next = None
        if leader.begin(timed, from_s, start, yaw):
            self._replacements += replaces
            self._since_s = now
            self._arrived.reset()
            self._path = timed.trajectory.path_enu_m
        elif leader.carrot is None:
            leader.timed = None
            leader.limited_by = "The trajectory cannot be joined from here within the limits."

    def _is_near(self, start: KinematicState, here: Located) -> bool:
        far_m = self._config.tracking_error_max_m
        return distance(start.position_enu_m, here.state.position_enu_m) <= far_m

    # --- how it ends ------------------------------------------------------------------

    def _ended(self, here: Located, observation: Observation, now: float) -> Outcome | None:
        """Return how it ends, if it does, and keep the status."""
        leader = self._leader
        carrot, timed = leader.carrot, leader.timed
        if carrot is None or timed is None:
            return None
        if not carrot.ended:
            self._since_s = now
            self._status = Status.BLOCKED if leader.is_blocked else Status.NAVIGATING
            return self._stalled(carrot.stalled_s)
        if not timed.ends_at_rest:
            self._status = Status.HOLDING
            return self._silence() if now - self._since_s > self._patience_s else None
        self._status = Status.SETTLING
        return self._arrival(timed, here, observation, now)

    def _stalled(self, stalled_s: float) -> Outcome | None:
        """Return the end of a trajectory on which the vehicle does not get on."""
        room = self._leader.room
        if room.blocks and stalled_s > self._blocked_s:
            code = OutcomeCode.NO_OBSTACLE_DATA if room.is_silent else OutcomeCode.NO_PATH
            text = f"The vehicle has stood for {self._blocked_s:g} s. {room.reason}"
            return Outcome(code, text, None)
        if not room.blocks and stalled_s > self._patience_s:
            text = f"The vehicle has not got on for {self._patience_s:g} s."
            return Outcome(OutcomeCode.TIMEOUT, f"{text} {self._leader.limited_by}", None)
        return None

    def _arrival(
        self, timed: TimedTrajectory, here: Located, observation: Observation, now: float
    ) -> Outcome | None:
        config, speed_m_s = self._config, measured_speed(observation)
        error_m = distance(here.position_enu_m, timed.trajectory.end_position_enu_m)
        slow = speed_m_s is not None and speed_m_s <= config.arrival_speed_m_s
        near = error_m <= config.arrival_radius_m
        if self._arrived.holds(near and slow, now):
            text = f"The trajectory was flown; its last point is {error_m:.2f} m away."
            return Outcome(OutcomeCode.SUCCESS, text, error_m)
        if now - self._since_s <= self._patience_s:
            return None
        text = (
            f"The vehicle did not settle at the last point within {self._patience_s:g} s: it is "
            f"{error_m:.2f} m away and moves at {speed_m_s or 0.0:.2f} m/s."
        )
        return Outcome(OutcomeCode.TIMEOUT, text, error_m)

    def _silence(self) -> Outcome:
        if self._leader.timed is None:
            text = self._leader.limited_by or "No trajectory has been received"
        else:
            text = "The last trajectory ended in motion, and no other has been received"
        text = f"{text.rstrip('.')} for {self._patience_s:g} s."
        return Outcome(OutcomeCode.TIMEOUT, text, None)
