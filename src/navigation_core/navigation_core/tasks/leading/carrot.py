"""The setpoint that runs ahead of the vehicle along a trajectory, and the one sent last.

A plan begins at the setpoint sent last, or where the vehicle is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from navigation_core.geometry import (
    ZERO,
    KinematicState,
    Vector3,
    add,
    limit_norm,
    scale,
    slew_angle,
    wrap_angle,
)
from navigation_core.planning.conflicts import clearance_at_m
from navigation_core.safety.braking import STANDING_M_S
from navigation_core.tasks.conditions import is_located, measured_state
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Setpoint
from navigation_core.tasks.leading.driven_path import DrivenPath
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.observation import Observation
from navigation_core.trajectories.trajectory import Trajectory

__all__ = ["Carrot", "Commanded", "SentSetpoint"]

# The carrot runs freely until the vehicle lags this share of the greatest tracking error.
_FREE_SHARE = 0.5
# Fastest change of the rate at which trajectory time passes, per second. At speed the
# acceleration limit is stricter.
_RATE_CHANGE_PER_S = 2.0
# A vehicle that is late may be sent a speed up to this many times the planned; see cruise_limits.
_HURRY_SHARE = 1.03
# Smoothing of the rate that the time remaining is divided by, and its floor.
_RATE_AVERAGE_S = 2.0
_RATE_FLOOR = 0.1
# Slower than this, a velocity has no direction.
_MOVES_M_S = 1e-6
# Trajectory time that counts as progress.
_PROGRESS_S = 0.5
# A setpoint this many times the greatest tracking error away is no start for a new flight.
_START_ERROR_SHARE = 1.5
# Farther than a vehicle that follows is from a setpoint that stands.
_RUN_OUT_M = 0.5
# A setpoint that was this fast may have stopped harder than the vehicle could follow, and for this
# long the vehicle may not have come back.
_RUN_OUT_M_S, _RUN_OUT_S = 1.0, 5.0
# Nearer to an obstacle than this is in it.
_IN_OBSTACLE_M = 0.3


class Carrot:
    """Walks along one trajectory.

    Trajectory time passes at a rate between 0 and 1. The rate is 1 while the vehicle is
    close; it falls to 0 as the measured position lags the setpoint by the greatest
    tracking error. So neither wind nor a slow vehicle lets the setpoint run away, which
    the vehicle would race after. The feed-forward scales with the rate and so stays the
    true derivative of the position.

    An autopilot flies the feed-forward, and as much faster as it is behind. So the rate also
    falls where the two together would exceed the speed: what the vehicle is late by is not made
    up for by flying too fast.

    Attributes:
        trajectory: where it walks.
        time_s: its position along the trajectory, in trajectory time.
        rate: the share of the planned speed that it has now.
        nominal: where it is on the trajectory, at the speed that is planned there.
        state: the setpoint's position and its true derivatives.
        yaw_enu_rad: the setpoint's yaw.
        distance_remaining_m: length of the path that is left.
        aside_enu_m: how far beside the trajectory the setpoint is sent.
        room_m: tracking error at which it waits for the vehicle.
    """

    def __init__(
        self,
        trajectory: Trajectory,
        config: GotoConfig,
        yaw_enu_rad: float,
        yaw_goal_enu_rad: float,
        time_s: float = 0.0,
    ) -> None:
        """Stand at the beginning, or further on.

        Args:
            trajectory: where to walk.
            config: its ``tracking_error_max_m``, ``tracking_lag_s``, ``following_gain_per_s``
                and ``response_s``.
            yaw_enu_rad: yaw to begin with.
            yaw_goal_enu_rad: yaw to turn to, the shorter way round.
            time_s: where to stand, in trajectory time.
        """
        self.trajectory = trajectory
        self._config = config
        self.yaw_enu_rad = wrap_angle(yaw_enu_rad)
        self._yaw_goal_enu_rad = wrap_angle(yaw_goal_enu_rad)
        self.time_s = time_s
        self._stalled_s = 0.0
        self._stalled_at_s = time_s
        self.rate = 1.0
        self._rate_average = 1.0
        self.nominal, self._limits = trajectory.at(time_s)
        self.distance_remaining_m = trajectory.remaining_distance_m(time_s)
        self.state = self.nominal
        self._yaw_rate_rad_s = trajectory.limits.yaw_rate_rad_s
        self._turn_rate_rad_s = 0.0
        self._driven: DrivenPath | None = None
        self.aside_enu_m = ZERO
        self.room_m = config.tracking_error_max_m

    def ahead(self, lead_s: float) -> tuple[float, KinematicState]:
        """Return where it will stand after a while at its present pace, and in which state.

        Args:
            lead_s: the time to look ahead.

        Returns:
            Trajectory time and state.
        """
        if lead_s <= 0.0:
            return self.time_s, self.state
        time_s = self.time_s + self.rate * lead_s
        return time_s, self._scaled(self.trajectory.at(time_s)[0], 0.0)

    def turn_to(self, yaw_enu_rad: float) -> None:
        """Turn to another yaw from now on, the shorter way round."""
        self._yaw_goal_enu_rad = wrap_angle(yaw_enu_rad)

    def turn_on(self, rate_rad_s: float) -> None:
        """Turn on and on from now on, up to the end of the trajectory."""
        self._turn_rate_rad_s = rate_rad_s

    @property
    def setpoint(self) -> Setpoint:
        """The setpoint to send now.

        An airframe needs time to lean. While it gains speed over ground, the acceleration that is
        wanted after that time is sent; else it would keep accelerating beyond the speed. Not
        while it brakes: it would stop short of its target.
        """
        state = self.state
        acceleration, velocity = state.acceleration_enu_m_s2, state.velocity_enu_m_s
        if acceleration[0] * velocity[0] + acceleration[1] * velocity[1] > 0.0:
            now = self.nominal.acceleration_enu_m_s2
            lean_s = self._config.response_s * self.rate
            leaning, _ = self.trajectory.at(self.time_s + lean_s)
            then = leaning.acceleration_enu_m_s2
            gain = self.rate * self.rate
            acceleration = (
                acceleration[0] + gain * (then[0] - now[0]),
                acceleration[1] + gain * (then[1] - now[1]),
                acceleration[2],
            )
        position = add(state.position_enu_m, self.aside_enu_m)
        return Setpoint(position, velocity, acceleration, self.yaw_enu_rad)

    @property
    def stalled_s(self) -> float:
        """Time since the carrot last made progress; 0 once it has come to its end."""
        return self._stalled_s if self.time_s < self.trajectory.duration_s else 0.0

    @property
    def ended(self) -> bool:
        """Whether the trajectory has come to its end."""
        return self.time_s >= self.trajectory.duration_s

    @property
    def arrived(self) -> bool:
        """Whether the trajectory and the turn have come to their end."""
        turned = self.yaw_enu_rad == self._yaw_goal_enu_rad
        return turned and self.time_s >= self.trajectory.duration_s

    @property
    def time_remaining_s(self) -> float:
        """Time that is left at the pace of the last seconds."""
        left_s = max(self.trajectory.duration_s - self.time_s, 0.0)
        turn_s = abs(wrap_angle(self._yaw_goal_enu_rad - self.yaw_enu_rad)) / self._yaw_rate_rad_s
        return max(left_s / max(self._rate_average, _RATE_FLOOR), turn_s)

    def advance(self, dt_s: float, position_enu_m: Vector3 | None, rate_max: float = 1.0) -> None:
        """Walk on.

        Args:
            dt_s: time since the last call.
            position_enu_m: measured position of this moment; None to walk without waiting.
            rate_max: share of the planned speed that it may have.
        """
        if dt_s <= 0.0:
            return
        before = self.rate
        self.rate = self._next_rate(dt_s, position_enu_m, rate_max)
        # The mean of both rates makes the position the integral of the velocity.
        self._walk_to(self.time_s + 0.5 * (before + self.rate) * dt_s, self.rate, dt_s)
        self.state = self._scaled(self.nominal, (self.rate - before) / dt_s)
        if self._turn_rate_rad_s:
            if not self.ended:
                self.yaw_enu_rad = wrap_angle(self.yaw_enu_rad + self._turn_rate_rad_s * dt_s)
            self._yaw_goal_enu_rad = self.yaw_enu_rad
        elif self.yaw_enu_rad != self._yaw_goal_enu_rad:
            self.yaw_enu_rad = slew_angle(
                self.yaw_enu_rad, self._yaw_goal_enu_rad, self._yaw_rate_rad_s * dt_s
            )

    def follow(
        self, dt_s: float, position_enu_m: Vector3, braking_m_s2: float, until_s: float = math.inf
    ) -> DrivenPath:
        """Walk on to where a vehicle has come to that drives, at whatever pace.

        Args:
            dt_s: time since the last call.
            position_enu_m: measured position of this moment.
            braking_m_s2: how hard the vehicle is meant to brake before corners.
            until_s: up to when, in trajectory time, the path may be looked ahead to.

        Returns:
            The path, which knows what is ahead.
        """
        if self._driven is None:
            self._driven = DrivenPath(self.trajectory, braking_m_s2, self.time_s)
        self._driven.limit(until_s)
        self._driven.aside_enu_m = self.aside_enu_m
        self._driven.advance(position_enu_m)
        if dt_s > 0.0:
            time_s = max(self._driven.time_s, self.time_s)
            self._walk_to(time_s, (time_s - self.time_s) / dt_s, dt_s)
            self.state = self.nominal
        return self._driven

    def wind_back(self, duration_s: float) -> Trajectory:
        """Continue from an earlier time at which the trajectory was in the same state as now.

        Args:
            duration_s: how much earlier that was.

        Returns:
            The trajectory, as another object: what was reserved along it has been passed.
        """
        self.trajectory = replace(self.trajectory)
        self.time_s -= duration_s
        self._stalled_at_s -= duration_s
        self._driven = None
        self.distance_remaining_m = self.trajectory.remaining_distance_m(self.time_s)
        return self.trajectory

    def restart_patience(self) -> None:
        """Count the time without progress from now on: it was to wait."""
        self._stalled_s = 0.0

    def finish(self) -> None:
        """Walk to the end at once."""
        self._walk_to(self.trajectory.duration_s, self.rate, 0.0)
        self.state = self.nominal

    def _walk_to(self, time_s: float, rate: float, dt_s: float) -> None:
        share = min(dt_s / _RATE_AVERAGE_S, 1.0)
        self._rate_average += share * (rate - self._rate_average)
        if time_s != self.time_s:
            self.time_s = time_s
            self.nominal, self._limits = self.trajectory.at(time_s)
            self.distance_remaining_m = self.trajectory.remaining_distance_m(time_s)
        self._stalled_s += dt_s
        if time_s - self._stalled_at_s >= _PROGRESS_S:
            self._stalled_s, self._stalled_at_s = 0.0, time_s

    def _next_rate(self, dt_s: float, position_enu_m: Vector3 | None, rate_max: float) -> float:
        wanted, change = rate_max, _RATE_CHANGE_PER_S
        course, allowed_m_s = ZERO, math.inf
        speed_m_s = math.hypot(*self.nominal.velocity_enu_m_s)
        if speed_m_s > _MOVES_M_S:
            course = scale(self.nominal.velocity_enu_m_s, 1.0 / speed_m_s)
            axis = self._limits.along(course)
            change = min(change, axis.acceleration_m_s2 / speed_m_s)
            allowed_m_s = _HURRY_SHARE * axis.speed_forward_m_s
        if position_enu_m is not None:
            (x, y, z), (x_0, y_0, z_0) = self.state.position_enu_m, position_enu_m
            offset = (x - x_0, y - y_0, z - z_0)
            behind_m = offset[0] * course[0] + offset[1] * course[1] + offset[2] * course[2]
            room_m = self.room_m
            free_m = room_m * (1.0 - _FREE_SHARE)
            led_m_s = self.rate * speed_m_s
            if led_m_s < _MOVES_M_S:
                room_m -= math.hypot(*offset)
            else:  # behind or beside the setpoint; ahead of it does not count
                late_m = max(behind_m - self._config.tracking_lag_s * led_m_s, 0.0)
                room_m -= math.hypot(late_m, math.dist(offset, scale(course, behind_m)))
            wanted = min(max(room_m / free_m, 0.0), rate_max)
            if speed_m_s > _MOVES_M_S:
                hurry_m_s = self._config.following_gain_per_s * behind_m
                wanted = min(wanted, max((allowed_m_s - hurry_m_s) / speed_m_s, 0.0))
        return min(max(wanted, self.rate - change * dt_s), self.rate + change * dt_s)

    def _scaled(self, nominal: KinematicState, rate_change_per_s: float) -> KinematicState:
        gain, limits = self.rate * self.rate, self._limits
        v_x, v_y, v_z = nominal.velocity_enu_m_s
        a_x, a_y, a_z = nominal.acceleration_enu_m_s2
        acceleration = (
            a_x * gain + v_x * rate_change_per_s,
            a_y * gain + v_y * rate_change_per_s,
            a_z * gain + v_z * rate_change_per_s,
        )
        ceiling = max(
            math.hypot(*nominal.acceleration_enu_m_s2),
            math.hypot(limits.acceleration_horizontal_m_s2, limits.acceleration_vertical_m_s2),
        )
        return KinematicState(
            nominal.position_enu_m,
            (v_x * self.rate, v_y * self.rate, v_z * self.rate),
            limit_norm(acceleration, ceiling),
        )


@dataclass(frozen=True)
class Commanded:
    """A setpoint.

    Attributes:
        state: its position and true derivatives.
        yaw_enu_rad: its yaw.
    """

    state: KinematicState
    yaw_enu_rad: float


class SentSetpoint:
    """The setpoint of one flight that was sent last, by this flight or the one that it replaces.

    Attributes:
        commanded: the setpoint; None before the first.
        is_stale: whether time has passed without setpoints, so that the last one says nothing.
    """

    def __init__(self, terms: FlightTerms) -> None:
        """Begin with that of the flight that is replaced, if there is one."""
        self._config = terms.config
        # A rover or boat is led from its measured position, not from the planned one.
        self._begins_here = not terms.traits.flies
        self.commanded: Commanded | None = None
        state, yaw_enu_rad = terms.handover.commanded, terms.handover.yaw_enu_rad
        if state is not None and yaw_enu_rad is not None:
            self.commanded = Commanded(state, yaw_enu_rad)
        self.is_stale = False
        self._handover_s = terms.handover.time_s
        self._stepped_s = self._to_walk_s = 0.0
        self._moved_s = -math.inf

    def start(self, now: float) -> None:
        """Count the time from now on, or from when another flight sent its last setpoint."""
        self._stepped_s = now if self._handover_s is None else self._handover_s

    def step_begins(self, now: float) -> bool:
        """Count the time since the last step; return whether that was too long a gap."""
        self._to_walk_s = max(now - self._stepped_s, 0.0)
        self._stepped_s = now
        return self._to_walk_s > self._config.step_gap_s

    def take_time_s(self) -> float:
        """Return the time that the setpoint has yet to move on in this step: once."""
        time_s, self._to_walk_s = self._to_walk_s, 0.0
        return time_s

    def note(self, carrot: Carrot) -> None:
        """Remember the setpoint that is sent."""
        self.commanded = Commanded(carrot.state, carrot.yaw_enu_rad)
        if math.hypot(*carrot.state.velocity_enu_m_s) > _RUN_OUT_M_S:
            self._moved_s = self._stepped_s

    def outdate(self) -> None:
        """Let the next plan begin where the vehicle is."""
        self.is_stale = True

    def beginning(self, observation: Observation) -> Commanded | None:
        """Return the last setpoint if that still makes sense, else where the vehicle is.

        Returns:
            The setpoint to begin with; None if nothing is known.
        """
        located, sent = is_located(observation, self._config.position_stale_s), self.commanded
        if sent is None or (located and self._is_no_start(sent, observation)):
            yaw_enu_rad = observation.yaw_enu_rad
            if not located or yaw_enu_rad is None:
                return None
            sent = self.commanded = Commanded(self._measured(observation), yaw_enu_rad)
            self.is_stale = False
            self._to_walk_s = 0.0
        return sent

    def start_around(self, sent: Commanded, observation: Observation) -> KinematicState:
        """Return where a path around obstacles begins."""
        located = is_located(observation, self._config.position_stale_s)
        if located and self.is_left(sent, observation):
            return self._measured(observation)
        return sent.state

    def is_left(self, sent: Commanded, observation: Observation) -> bool:
        """Whether a path begins where the vehicle is, and not at its setpoint.

        It does for a rover or boat; and for an aircraft that has not stopped at its setpoint but
        somewhere further on: an emergency's brake may be harder than the autopilot follows. A
        path that began at the setpoint would lead back first, or to another side of an approaching
        obstacle. An aircraft that the wind has pushed away from a setpoint that stood all the time
        is another matter: its autopilot leans into the wind by as much as it is behind, and would
        stop doing so if the setpoint came to it. Each such plan would let it drift on.

        A setpoint that is in an obstacle is left, too. Only the face of a wall is known, so a path
        from within would lead out on its other side.
        """
        if self._begins_here or _is_in_obstacle(sent, observation):
            return True
        if self._stepped_s - self._moved_s > _RUN_OUT_S:
            return False
        if math.hypot(*sent.state.velocity_enu_m_s) > STANDING_M_S:
            return False
        if not is_located(observation, self._config.position_stale_s):
            return False
        here = measured_state(observation).position_enu_m
        return math.dist(here, sent.state.position_enu_m) > _RUN_OUT_M

    def _is_no_start(self, sent: Commanded, observation: Observation) -> bool:
        """Whether the last setpoint is nothing to continue from."""
        if self._begins_here or self.is_stale:
            return True
        here = measured_state(observation).position_enu_m
        error_m = math.dist(sent.state.position_enu_m, here)
        return error_m > _START_ERROR_SHARE * self._config.tracking_error_max_m

    def _measured(self, observation: Observation) -> KinematicState:
        """Return the state that a flight begins with where the vehicle is."""
        here = measured_state(observation)
        if self._begins_here and math.hypot(*here.velocity_enu_m_s) < STANDING_M_S:
            # A standstill is measured with a little speed, in any direction. A brake that begins
            # with it, asked for again and again, would pass it on, and the vehicle would creep.
            return KinematicState(here.position_enu_m)
        return here


def _is_in_obstacle(sent: Commanded, observation: Observation) -> bool:
    """Whether a setpoint is where no vehicle can be, while the vehicle is farther away."""
    if observation.position_enu_m is None:
        return False
    place, limit_m = sent.state.position_enu_m, _IN_OBSTACLE_M
    sent_m = clearance_at_m(place, observation.obstacles_now, limit_m)
    here = measured_state(observation).position_enu_m
    return sent_m < limit_m and sent_m < clearance_at_m(here, observation.obstacles_now, limit_m)
