"""Flies a plane by velocity commands: course over ground, climb and airspeed.

A plane follows no velocity. It is sent to a place far ahead on the course, again each second, and
circles the last of them if nothing follows: so it also does when the server ends. No place is sent
whose circle leaves the flight volume or the vehicle's fence.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from navigation_core.geometry import KinematicState, Vector3, horizontal_norm, wrap_angle
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.speed_at_bounds import Bounds, SpeedAtBounds
from navigation_core.tasks.conditions import located
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.inputs.velocity_command import VelocityCommand, VelocityFrame
from navigation_core.tasks.intents import Outcome, StopFirst, Wait
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.phased_task import Answer
from navigation_core.tasks.phases import Phase
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.steering.command_silence import CommandSilence
from navigation_core.tasks.traffic.traffic_view import TrafficView
from navigation_core.tasks.traits import Traits
from navigation_core.tasks.watching.plane_route import HEIGHT_ERROR_M, circle_max_m
from navigation_core.tasks.watching.sent_plane import SentPlane

__all__ = ["CourseTerms", "FlyPlaneCourse"]

# Time between two places that are sent; ArduPlane kept a course within 0.2 degrees so (observed).
_SEND_EVERY_S = 1.0
# Both firmwares fly straight towards a place that is this many radii of their circle away, and turn
# into the circle from there on (ArduPlane's navigation.cpp; observed). The time is for the flight
# until the next place has arrived.
_AHEAD_CIRCLES, _AHEAD_S = 3.0, 2.5
# Slower over ground than this, the nose is the course.
_COURSE_LEAST_M_S = 3.0
# A course that is turned by commands leads the plane by this much at most.
_LEAD_MAX_RAD = math.radians(60.0)
# For the status: it turns while it is off its course by more than the first, and climbs faster than
# the second.
_TURNS_RAD, _CLIMBS_M_S = math.radians(10.0), 0.2
# A height that is changed by commands leads the plane by its rate for this time, and a little more:
# both firmwares climb by the error over 3 to 5 s (ArduPlane's TECS, PX4's FW_T_ALT_TC).
_HEIGHT_LAG_S, _HEIGHT_NEAR_M = 6.0, 1.0
# At a bound, a course that differs by this from the one that led there is tried.
_OTHER_COURSE_RAD = math.radians(10.0)
_OUT = "The commanded course leads out of the flight volume or the vehicle's fence."
_OUT_VERTICALLY = "The commanded climb leads out of the flight volume or the vehicle's fence."
# A vehicle reports its mode once a second.
_MODE_REPORT_S = 2.0
# A joystick is never quite still; a new airspeed is asked for in such steps.
_SPEED_STEP_M_S = 0.5


@dataclass(frozen=True)
class CourseTerms:
    """How to follow.

    Attributes:
        config: limits of speed, climb and time.
        traits: what the plane can do; its airspeeds are known.
        bounds: the flight volume, and the margin to the vehicle's fence.
        command_timeout_s: age from which a command counts no more.
        max_speed_m_s: highest airspeed.
    """

    config: GotoConfig
    traits: Traits
    bounds: Bounds
    command_timeout_s: float
    max_speed_m_s: float


class FlyPlaneCourse(SentPlane):
    """The task. See :class:`navigation_core.tasks.task.Task`."""

    def __init__(self, terms: CourseTerms) -> None:
        """Prepare."""
        super().__init__(terms.config, terms.traits)
        self._terms = terms
        self._inset_m = circle_max_m(terms.traits.circle_radius_m)
        self._silence = CommandSilence(terms.command_timeout_s, terms.config.settle_timeout_s)
        self._status, self._held_back = Status.PREPARING, ""
        self._place: Vector3 | None = None  # that it is sent to, within the bounds
        self._place_s, self._step_s = -math.inf, 0.0
        self._holds = False
        self._course_rad: float | None = None
        self._edge_rad: float | None = None  # the course that led to a bound
        self._height_m: float | None = None
        self._climbs = False
        self._rejected_s = -math.inf  # when the vehicle rejected its place first
        self._handlers = {Phase.PREPARING: self._prepare, Phase.NAVIGATING: self._follow}

    # --- the task protocol -----------------------------------------------------------

    def start(self, observation: Observation, now: float) -> None:
        """Begin."""
        super().start(observation, now)
        self._silence.begin(now)

    def unpause(self, now: float) -> None:
        """Follow again."""
        super().unpause(now)
        self._silence.begin(now)

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the status; there is no distance and no time to a target."""
        if self._phase is not Phase.NAVIGATING:
            return super().progress(observation, now)
        waiting = self._giving_way.waiting
        if waiting is not None:
            return Progress(Status.WAITING_FOR_TRAFFIC, 0.0, 0.0, blocked=waiting.text)
        return Progress(self._status, 0.0, 0.0, blocked=self._held_back)

    # --- the state machine -----------------------------------------------------------

    def _go(self, phase: Phase, now: float) -> None:
        super()._go(phase, now)
        self._silence.begin(now)
        self._holds, self._place_s = False, -math.inf
        self._course_rad = self._edge_rad = self._height_m = None
        self._step_s = now

    def _prepare(self, observation: Observation, now: float) -> Answer:
        if self._departure.moves(observation):
            return Phase.NAVIGATING
        text = "The vehicle is not flying; velocity commands neither arm nor take off."
        return Outcome(OutcomeCode.NOT_FLYING, text, None)

    def _follow(self, observation: Observation, now: float) -> Answer:
        dt_s, self._step_s = now - self._step_s, now
        if self._pause_asked or observation.position_doubt:
            return self._begin_stay(observation)
        known = located(observation, self._config.position_stale_s)
        if known is None:
            return Wait()
        command = self._silence.current(observation.command, now)
        ended = self._silence.ended(now) if command is None else None
        if ended is not None:
            return StopFirst(ended)
        self._held_back = self._rejection(command)
        if command is None or command.is_zero or self._held_back:
            self._hold(observation, now)
        else:
            gap_s = self._config.step_gap_s
            self._steer(command, known.state, known.yaw_enu_rad, 0.0 if dt_s > gap_s else dt_s)
            self._look_ahead(known.state, observation, now)
        return self._send(command, observation, now)

    def _send(
        self, command: VelocityCommand | None, observation: Observation, now: float
    ) -> Answer:
        """Have it fly to the place, with the airspeed that is asked for."""
        if self._place is None or now - self._rejected_s <= _MODE_REPORT_S:
            return Wait()
        answer: Answer = self._destination.send(self._place, observation, now, keeps_mode=True)
        if isinstance(answer, Outcome) and self._rejected_s == -math.inf:
            # Most often somebody else has chosen a mode, which it is about to report.
            self._rejected_s = now
            self._requests.forget()
            return Wait()
        if answer is None:
            self._rejected_s = -math.inf
        if answer is None and command is not None and not self._holds:
            step_m_s = _SPEED_STEP_M_S * round(self._speed_m_s(command) / _SPEED_STEP_M_S)
            speed_m_s = max(min(step_m_s, self._terms.max_speed_m_s), self._traits.airspeed_min_m_s)
            answer = self._leg_speed.ask(speed_m_s, observation, now)
        view, waiting = TrafficView.of(observation), self._giving_way.waiting
        if view is None or waiting is None:
            self._giving_way.restart()
        elif self._giving_way.waited_s > view.timeout_s:
            return self._over(OutcomeCode.TRAFFIC, waiting.text, observation)
        return answer or Wait()

    # --- what is commanded -------------------------------------------------------------

    def _speed_m_s(self, command: VelocityCommand) -> float:
        """Return the airspeed that is asked for, negative for backwards."""
        forward, left, _ = command.linear_m_s
        asked_m_s = forward if command.frame is VelocityFrame.BODY else math.hypot(forward, left)
        return min(asked_m_s, self._terms.max_speed_m_s)

    def _rejection(self, command: VelocityCommand | None) -> str:
        """Return why a plane cannot fly a command; empty if it can, or circles for it."""
        if command is None or command.is_zero:
            return ""
        speed_m_s, least_m_s = self._speed_m_s(command), self._traits.airspeed_min_m_s
        if speed_m_s < 0.0:
            return "A plane cannot fly backwards."
        if speed_m_s == 0.0:
            return "A plane climbs, and turns, with a speed only: command one over ground, too."
        if speed_m_s < least_m_s:
            return (
                f"A speed of {speed_m_s:.3g} m/s is commanded; the least airspeed of this plane "
                f"is {least_m_s:.3g} m/s."
            )
        return ""

    def _steer(
        self, command: VelocityCommand, here: KinematicState, yaw_enu_rad: float, dt_s: float
    ) -> None:
        """Turn the course, and move the height, as commanded."""
        flown_rad, limits = _course_rad(here, yaw_enu_rad), self._config.limits
        x, y, up_m_s = command.linear_m_s
        if command.frame is VelocityFrame.MAP:
            self._course_rad = math.atan2(y, x)
        else:
            before_rad = flown_rad if self._course_rad is None else self._course_rad
            most_rad_s = limits.yaw_rate_rad_s
            if self._traits.circle_acceleration_m_s2 > 0.0:
                turning_rad_s = self._traits.circle_acceleration_m_s2 / self._speed_m_s(command)
                most_rad_s = min(most_rad_s, turning_rad_s)
            rate_rad_s = min(max(command.yaw_rate_rad_s, -most_rad_s), most_rad_s)
            course_rad = before_rad + rate_rad_s * dt_s
            if self._edge_rad is None:
                lead_rad = wrap_angle(course_rad - flown_rad)
                course_rad = flown_rad + min(max(lead_rad, -_LEAD_MAX_RAD), _LEAD_MAX_RAD)
            self._course_rad = wrap_angle(course_rad)
        climb_m_s = min(max(up_m_s, -limits.speed_down_m_s), limits.speed_up_m_s)
        self._climb(climb_m_s, here.position_enu_m[2], dt_s)
        self._status = Status.NAVIGATING
        if abs(wrap_angle(self._course_rad - flown_rad)) > _TURNS_RAD:
            self._status = Status.TURNING
        elif abs(climb_m_s) > _CLIMBS_M_S:
            self._status = Status.CLIMBING if climb_m_s > 0.0 else Status.DESCENDING

    def _climb(self, climb_m_s: float, z_m: float, dt_s: float) -> None:
        """Move the height, so far ahead of the plane as it lags at this rate, and not behind it."""
        climbs = abs(climb_m_s) > _CLIMBS_M_S
        height_m = z_m if self._height_m is None else self._height_m + climb_m_s * dt_s
        if climbs or self._climbs:
            ahead_m = _HEIGHT_LAG_S * climb_m_s
            low_m, high_m = min(ahead_m, 0.0) - _HEIGHT_NEAR_M, max(ahead_m, 0.0) + _HEIGHT_NEAR_M
            height_m = min(max(height_m, z_m + low_m), z_m + high_m)
        self._height_m, self._climbs = height_m, climbs

    # --- where to ------------------------------------------------------------------------

    def _look_ahead(self, here: KinematicState, observation: Observation, now: float) -> None:
        """Choose the place ahead; at a bound the last one before it, which is kept."""
        if self._course_rad is None or self._height_m is None:
            return
        self._holds, room = False, self._room(observation)
        low_m, high_m = self._heights(observation, room)
        height_m = self._height_m = min(max(self._height_m, low_m), high_m)
        if height_m in (low_m, high_m) and self._status in (Status.CLIMBING, Status.DESCENDING):
            rises = self._status is Status.CLIMBING
            self._held_back = _OUT_VERTICALLY if rises == (height_m == high_m) else ""
        if now - self._place_s < _SEND_EVERY_S:
            self._blocked_at_edge()
            return
        edge_rad, course_rad = self._edge_rad, self._course_rad
        kept = edge_rad is not None and abs(wrap_angle(course_rad - edge_rad)) < _OTHER_COURSE_RAD
        place = self._place
        if not kept or place is None or room.room_m((place[0], place[1])) < self._inset_m:
            x, y, _ = here.position_enu_m
            way = (math.cos(course_rad), math.sin(course_rad))
            straight_m = _AHEAD_CIRCLES * self._traits.circle_radius_m
            far_m = straight_m + _AHEAD_S * horizontal_norm(here.velocity_enu_m_s)
            ahead_m = room.farthest_m((x, y), way, far_m, self._inset_m)
            at_edge = ahead_m is None or ahead_m < straight_m
            self._edge_rad = course_rad if at_edge else None
            if ahead_m is not None:
                self._place = (x + ahead_m * way[0], y + ahead_m * way[1], height_m)
            elif self._place is None:
                self._place = self._place_to_stay(observation)
        if self._place is not None:
            self._place = (self._place[0], self._place[1], height_m)
        self._place_s = now
        self._blocked_at_edge()

    def _blocked_at_edge(self) -> None:
        if self._edge_rad is not None:
            self._status, self._held_back = Status.BLOCKED, _OUT

    def _hold(self, observation: Observation, now: float) -> None:
        """Circle here from now on."""
        self._status = Status.BLOCKED if self._held_back else Status.HOLDING
        if self._holds:
            return
        self._place, self._place_s = self._place_to_stay(observation), -math.inf
        self._holds = self._place is not None
        self._course_rad = self._edge_rad = self._height_m = None

    def _place_to_stay(self, observation: Observation) -> Vector3 | None:
        """Return where to circle: here, or near a bound where it was sent to last."""
        here = super()._place_to_stay(observation)
        if here is None:
            return None
        low_m, high_m = self._heights(observation, self._room(observation))
        here = (here[0], here[1], min(max(here[2], low_m), high_m))
        free_m = self._room(observation).room_m((here[0], here[1]))
        return self._place if free_m < self._inset_m and self._place is not None else here

    def _room(self, observation: Observation) -> SpeedAtBounds:
        home, bounds = observation.home_enu_m, self._terms.bounds
        home_m = observation.ground_enu_m if home is None else home[2]
        return SpeedAtBounds(bounds.volume, observation.fence, home_m, bounds.fence_margin_m)

    def _heights(self, observation: Observation, room: SpeedAtBounds) -> tuple[float, float]:
        """Return the least and the greatest height of its circles, in the map frame."""
        low_m, high_m = room.heights_m(observation.ground_enu_m)
        low_m = max(low_m, observation.ground_enu_m + self._traits.height_min_m) + HEIGHT_ERROR_M
        high_m -= HEIGHT_ERROR_M
        middle_m = 0.5 * (low_m + high_m)
        return min(low_m, middle_m), max(high_m, middle_m)


def _course_rad(here: KinematicState, yaw_enu_rad: float) -> float:
    """Return the course over ground, in the map frame."""
    east, north, _ = here.velocity_enu_m_s
    if math.hypot(east, north) < _COURSE_LEAST_M_S:
        return yaw_enu_rad
    return math.atan2(north, east)
