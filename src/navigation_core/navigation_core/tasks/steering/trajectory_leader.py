"""Leads a copter along a trajectory that another program has planned, as fast as that is safe.

The setpoint walks along the trajectory (:class:`~navigation_core.tasks.leading.carrot.Carrot`), at
most as fast as the room ahead lets it stop on the trajectory itself: before obstacles, the bounds
of the flight volume and the vehicle's fence. So a vehicle that is stopped stays on its path.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from navigation_core.geometry import ZERO, KinematicState, distance, norm, wrap_angle
from navigation_core.limits import Limits, stopping_distance_m, stopping_speed_m_s
from navigation_core.mapping.obstacles import Array
from navigation_core.outcomes import OutcomeCode
from navigation_core.planning.conflicts import MotionSamples, first_conflict
from navigation_core.safety.braking import must_brake
from navigation_core.safety.late_setpoints import LATE_S, speed_share
from navigation_core.safety.speed_at_bounds import SpeedAtBounds
from navigation_core.tasks.conditions import Located
from navigation_core.tasks.intents import Fly, Setpoint
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.leading.run_out_limiter import RunOutLimiter
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.steering.commanded_speed import free_share
from navigation_core.tasks.steering.tracking_trim import TrackingTrim
from navigation_core.tasks.traffic.path_in_traffic import BRAKE_SHARE
from navigation_core.tasks.traffic.reserved_path import REACTION_S
from navigation_core.tasks.traffic.traffic_view import TrafficView
from navigation_core.trajectories.timed_trajectory import TimedTrajectory, join

__all__ = ["Room", "TrajectoryLeader"]

# Share of the acceleration that is counted on to stop, time until it begins, and what is kept.
_BRAKE_SHARE, _REACTION_S, _KEPT_M = 0.7, 0.4, 0.3
# Samples are this far apart in time; two of them are looked at beyond the stop.
_BEYOND_S = 0.5
# By this much a trajectory that is accepted may seem to be beyond a bound.
_ROUNDING_M = 0.1
_HEIGHT_MARGIN_M = 0.5
# A share of the speed that is less by this is worth a sentence.
_NOTICED = 0.05
# Slower than this there is no course to face.
_COURSE_M_S = 0.3
_STANDS_RATE = 0.02
# Shares of the speed that are tried for other vehicles.
_SHARES = (1.0, 0.75, 0.5, 0.35, 0.2, 0.1, 0.0)


@dataclass(frozen=True)
class Room:
    """How fast a trajectory may be flown now.

    Attributes:
        share: of its planned speed.
        reason: why it is less than all, a sentence; empty if it is not.
        blocks: whether the vehicle is to stop for it.
        code: how the goal ends if it stays so.
        patience_s: for how long it may; None for as long as without progress.
    """

    share: float = 1.0
    reason: str = ""
    blocks: bool = False
    code: OutcomeCode = OutcomeCode.TIMEOUT
    patience_s: float | None = None


class TrajectoryLeader:
    """Leads one vehicle.

    Attributes:
        timed: the trajectory that is flown; None before the first.
        carrot: the setpoint on it; None while the vehicle is not led.
        room: how fast it may be flown now.
        left_at_s: time of the trajectory up to which it was flown before it was last forgotten.
        limited_by: why it is or was last flown slower than it was planned; empty if it never was.
        error_m: distance between the vehicle and the setpoint's place on the trajectory.
    """

    def __init__(self, terms: FlightTerms, limits: Limits) -> None:
        """Prepare.

        Args:
            terms: settings, traits, obstacles and bounds.
            limits: what trajectories are flown within.
        """
        self._terms = terms
        self._limits = limits
        self._run_out_limiter = RunOutLimiter(terms.avoidance, terms.traits, limits, terms.bounds)
        avoidance = terms.avoidance
        self._blocked_s = None if avoidance is None else avoidance.blocked_timeout_s
        self._trim = TrackingTrim(limits)
        self._samples: MotionSamples | None = None
        self._ahead_s = 0.0
        self.left_at_s = 0.0
        self.timed: TimedTrajectory | None = None
        self.carrot: Carrot | None = None
        self.room = Room()
        self.limited_by = ""
        self.error_m = math.nan

    def begin(
        self, timed: TimedTrajectory, from_s: float, start: KinematicState, yaw_enu_rad: float
    ) -> bool:
        """Fly a trajectory from a state on; return whether the limits allow that.

        Args:
            timed: the trajectory.
            from_s: where it is joined.
            start: the setpoint sent last, or the measured state.
            yaw_enu_rad: the yaw that belongs to it.
        """
        joined = join(start, timed, from_s, self._limits)
        if joined is None:
            return False
        motion, self._ahead_s = joined
        self.timed = timed
        self.carrot = Carrot(motion, self._terms.config, yaw_enu_rad, yaw_enu_rad)
        self._samples = MotionSamples.of(motion)
        if timed.why_slower:
            self.limited_by = f"{timed.why_slower} It is flown {timed.slower:.2f} times slower."
        return True

    def forget(self) -> None:
        """Lead no longer: what was sent is past. The trajectory is kept."""
        if self.carrot is not None:
            self.left_at_s = max(self.time_s, 0.0)
        self.carrot = self._samples = None
        self.room = Room()
        self._trim.restart()

    @property
    def time_s(self) -> float:
        """Time of the trajectory at the setpoint."""
        return 0.0 if self.carrot is None else self.carrot.time_s + self._ahead_s

    @property
    def is_blocked(self) -> bool:
        """Whether the vehicle stands because of an obstacle or a bound."""
        return self.carrot is not None and self.room.blocks and self.carrot.rate < _STANDS_RATE

    def lead(self, here: Located, observation: Observation, dt_s: float, stops: bool) -> Fly | None:
        """Return the setpoint to send now; None while it is not led.

        Args:
            here: where the vehicle is.
            observation: the vehicle.
            dt_s: time since the last setpoint.
            stops: whether it is to stop on the trajectory, and stand there.
        """
        carrot = self.carrot
        if carrot is None:
            return None
        self.room = self._room(carrot, here, observation)
        self._turn(carrot, dt_s)
        yaw = carrot.yaw_enu_rad
        carrot.advance(dt_s, here.state.position_enu_m, 0.0 if stops else self.room.share)
        self.error_m = distance(here.state.position_enu_m, carrot.state.position_enu_m)
        if not stops and not carrot.ended:
            self._note(carrot)
        ends = stops or self.is_blocked
        setpoint = self._trim.trimmed(carrot, here.state, dt_s, ends)
        if not ends:
            rate_rad_s = wrap_angle(carrot.yaw_enu_rad - yaw) / dt_s if dt_s > 0.0 else 0.0
            setpoint = replace(setpoint, yaw_rate_rad_s=rate_rad_s)
        return Fly(self._run_out_limiter.limited(setpoint, observation))

    def _turn(self, carrot: Carrot, dt_s: float) -> None:
        """Turn to the yaw of the setpoint that comes next."""
        if self.timed is None:
            return
        ahead_s, state = carrot.ahead(dt_s)
        yaw = self.timed.yaw_at(ahead_s + self._ahead_s)
        east, north, _ = state.velocity_enu_m_s
        if yaw is None and math.hypot(east, north) > _COURSE_M_S:
            yaw = math.atan2(north, east)
        if yaw is not None:
            carrot.turn_to(yaw)

    def _note(self, carrot: Carrot) -> None:
        """Keep why the trajectory is flown slower than it was planned."""
        if self.room.share < 1.0 - _NOTICED:
            self.limited_by = self.room.reason
        elif carrot.rate < 1.0 - _NOTICED:
            self.limited_by = f"The vehicle is {self.error_m:.1f} m from the setpoint."

    def _room(self, carrot: Carrot, here: Located, observation: Observation) -> Room:
        """Return how fast it may be flown now: the least of all that limits it."""
        return min(
            self._sensed(observation),
            self._ahead(carrot, observation),
            self._braked(here, observation),
            self._if_server_ends(carrot, observation),
            self._in_traffic(carrot, observation),
            key=lambda room: room.share,
        )

    def _sensed(self, observation: Observation) -> Room:
        avoidance = self._terms.avoidance
        if avoidance is None or observation.obstacles_age_s <= avoidance.sensor_timeout_s:
            return Room()
        age_s = observation.obstacles_age_s
        since = f"been silent for {age_s:.1f} s" if math.isfinite(age_s) else "not reported yet"
        reason, patience_s = f"The obstacle sensor has {since}.", avoidance.blocked_timeout_s
        return Room(0.0, reason, True, OutcomeCode.NO_OBSTACLE_DATA, patience_s)

    def _braked(self, here: Located, observation: Observation) -> Room:
        avoidance = self._terms.avoidance
        if avoidance is None:
            return Room()
        clearance_m = avoidance.brake_clearance_m
        acts = must_brake(
            MotionSamples.at(here.state),
            observation.obstacles,
            self._limits,
            clearance_m,
            avoidance.reaction_s,
        )
        reason = f"An obstacle is nearer than {clearance_m:g} m to where the vehicle would stop."
        if not acts[0]:
            return Room()
        return Room(0.0, reason, True, OutcomeCode.NO_PATH, avoidance.blocked_timeout_s)

    def _if_server_ends(self, carrot: Carrot, observation: Observation) -> Room:
        share = self._run_out_limiter.speed_share(carrot, observation)
        if share >= 1.0:
            return Room()
        if speed_share(observation.late_s) <= share:
            reason = f"Setpoints were up to {max(observation.late_s, LATE_S):.2f} s late."
            return Room(share, reason)
        return Room(
            share,
            "If setpoints ended now, the vehicle would come too near to an obstacle or a bound.",
        )

    def _in_traffic(self, carrot: Carrot, observation: Observation) -> Room:
        """Return how fast it may be flown for other vehicles, whose volumes it does not enter."""
        view, state = TrafficView.of(observation), carrot.nominal
        speed_m_s = norm(state.velocity_enu_m_s)
        if view is None or speed_m_s < _COURSE_M_S or self._samples is None:
            return Room()
        braking_m_s2 = BRAKE_SHARE * self._limits.acceleration_horizontal_m_s2
        setpoint = Setpoint(state.position_enu_m, state.velocity_enu_m_s, ZERO, carrot.yaw_enu_rad)
        share, _ = free_share(
            view,
            setpoint,
            self._terms.traits.setpoint_timeout_s,
            braking_m_s2,
            observation.time_s,
        )
        # And the path itself, which may turn towards another vehicle.
        points = self._samples.ahead(carrot.time_s, state.position_enu_m)
        steps_m = np.linalg.norm(np.diff(points, axis=0), axis=1)
        along_m = np.concatenate([[0.0], np.cumsum(steps_m)])
        stop_m = stopping_distance_m(speed_m_s, REACTION_S, braking_m_s2) + _KEPT_M
        points = points[: int(np.searchsorted(along_m, stop_m)) + 2]
        line = view.volume(points)
        for tried in _SHARES:
            needed_m = stopping_distance_m(tried * speed_m_s, REACTION_S, braking_m_s2) + _KEPT_M
            count = int(np.searchsorted(along_m, needed_m)) + 1
            if view.reservations.blocked_by(view.name, line, count) is None:
                break
        share = min(share, tried)
        if share >= 1.0:
            return Room()
        reason = "Another vehicle is, or may be, ahead."
        return Room(share, reason, share == 0.0, OutcomeCode.TRAFFIC, view.timeout_s)

    def _ahead(self, carrot: Carrot, observation: Observation) -> Room:
        """Return how fast the trajectory may be flown for what is on it ahead."""
        if self._samples is None:
            return Room()
        speed_m_s = norm(carrot.nominal.velocity_enu_m_s)
        braking_m_s2 = _BRAKE_SHARE * min(
            self._limits.acceleration_horizontal_m_s2, self._limits.acceleration_vertical_m_s2
        )
        stop_m = stopping_distance_m(speed_m_s, _REACTION_S, braking_m_s2) + _KEPT_M
        points = self._samples.ahead(carrot.time_s, carrot.state.position_enu_m)
        steps_m = np.linalg.norm(np.diff(points, axis=0), axis=1)
        along_m = np.concatenate([[0.0], np.cumsum(steps_m)])
        # One more than reaches the stop, with what is flown until the next look.
        count = int(np.searchsorted(along_m, stop_m + _BEYOND_S * speed_m_s)) + 2
        points = points[:count]
        found = [self._obstructed(points, observation), self._beyond(points, observation)]
        rooms = []
        for index, reason in found:
            if index is None:
                continue
            free_m = max(float(along_m[max(index - 1, 0)]) - _KEPT_M, 0.0)
            allowed_m_s = stopping_speed_m_s(free_m, _REACTION_S, braking_m_s2)
            share = 1.0 if free_m > 0.0 else 0.0
            if speed_m_s > 0.0:
                share = min(allowed_m_s / speed_m_s, share)
            text, code = f"{reason}, {free_m:.1f} m ahead.", OutcomeCode.NO_PATH
            rooms.append(Room(share, text, True, code, self._blocked_s))
        return min(rooms, key=lambda room: room.share, default=Room())

    def _obstructed(self, points: Array, observation: Observation) -> tuple[int | None, str]:
        avoidance = self._terms.avoidance
        if avoidance is None:
            return None, ""
        clearance_m = avoidance.conflict_clearance_m
        index = first_conflict(points, observation.obstacles, clearance_m)
        return index, f"An obstacle is nearer than {clearance_m:g} m to the trajectory"

    def _beyond(self, points: Array, observation: Observation) -> tuple[int | None, str]:
        """Return the first point that is outside of the bounds, unless the vehicle is."""
        bounds = self._terms.bounds
        if bounds is None:
            return None, ""
        home, ground_m = observation.home_enu_m, observation.ground_enu_m
        room = SpeedAtBounds(
            bounds.volume,
            observation.fence,
            ground_m if home is None else home[2],
            bounds.fence_margin_m,
            volume_margin_m=0.0,
        )
        low_m, high_m = room.heights_m(ground_m)
        # The margin to the volume's heights is for what nobody has planned.
        low_m, high_m = low_m - _HEIGHT_MARGIN_M, high_m + _HEIGHT_MARGIN_M
        reason = "The trajectory leads out of the flight volume or the vehicle's fence"
        for index, (x, y, z) in enumerate(points.tolist()):
            inside = room.room_m((x, y)) >= -_ROUNDING_M
            inside &= low_m - _ROUNDING_M <= z <= high_m + _ROUNDING_M
            if not inside:
                return index, reason
        return None, reason
