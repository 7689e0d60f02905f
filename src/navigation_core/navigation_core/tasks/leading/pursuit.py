"""Steer a ground vehicle along its path: pure pursuit, as a velocity.

A rover or a boat moves along its nose only. It is sent a velocity: its direction is where to
head for, its length how fast. It heads for a point on the path ahead of it, as fast as the path,
the turn and the distance to the end allow, however late it is. A vehicle that follows velocities
stops by itself when they stop coming (ArduRover after 3 s, PX4 by its OFFBOARD failsafe); one that
follows a position does not.

Limits that no parameter of the vehicle gives are learned: how tight it turns, in
:mod:`.turning_circle`, and how slowly it moves at all, here.

R. C. Coulter, "Implementation of the Pure Pursuit Path Tracking Algorithm", 1992.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from navigation_core.geometry import (
    ZERO,
    Vector3,
    distance,
    dot,
    horizontal_norm,
    norm,
    scale,
    subtract,
    unit_between,
    wrap_angle,
)
from navigation_core.limits import Limits, stopping_distance_m
from navigation_core.tasks.intents import Setpoint
from navigation_core.tasks.leading.driven_path import DrivenPath
from navigation_core.tasks.leading.turning_circle import Pursuer, TurningCircle
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traits import Traits

__all__ = ["Pursuer", "Pursuit", "without_turn"]

# The end is approached in proportion to its distance when it is near.
_GAIN_1_S = 1.4
# Slower than this a car hardly steers; it is used while there is still a way to go.
_CRAWL_M_S = 0.4
# Fastest while the nose points more than a right angle away from where to go.
_TURNING_MAX_M_S = 2.0
# In a turn this share of the speed is commanded at which it would just get round to the point: at
# that speed itself the point would lie on the edge of its circle, and now and then within.
_TURN_MARGIN = 0.75
# How far ahead on the path is headed for: turning radii, seconds of the present speed, and as far
# as it is beside it.
_LOOK_AHEAD_RADII, _LOOK_AHEAD_S = 1.2, 0.6
# The speed is raised towards the greatest that is allowed at this rate, and by no more than the
# acceleration of the limits. The speed controllers of ground vehicles are slow integrators:
# ArduRover's overshoots a ramp that ends abruptly by 0.3 s times its slope (recorded set-up), and
# hardly one that eases in.
_EASE_1_S = 0.7
# Excess speed over ground is taken off the commanded speed this many times at once, and at this
# rate for as long as it lasts; both together up to half of the commanded speed. PX4's rovers drive
# 1.4 m/s when 1.0 is commanded (observed on its simulated one).
_EXCESS_GAIN, _EXCESS_1_S = 2.0, 1.0
# Commanded to stand when this near, in arrival radii; not commanded to drive again before it has
# drifted this far.
_STAND_SHARE, _RESTART_SHARE = 0.6, 0.95
# A vehicle that is commanded to move and has moved by less than this in this time is stuck, and
# gets more and more speed until it moves: PX4's simulated rover does not start below 0.8 m/s
# (observed).
_STUCK_WITHIN_M, _STUCK_AFTER_S, _PUSH_M_S2, _PUSH_MAX_M_S = 0.2, 1.5, 0.4, 1.5
# A vehicle that is to stop is sent this small velocity along its nose while it rolls faster than
# this: of a velocity of zero both firmwares take the direction, too: North, and steer there.
_ROLLS_M_S, _NEXT_TO_NOTHING_M_S = 0.1, 0.001


@dataclass(frozen=True)
class _CommandedSpeed:
    """The last commanded speed and its time."""

    speed_m_s: float
    time_s: float


class Pursuit:
    """Leads one vehicle along; remembers its last command, so that speeds change gently."""

    def __init__(self, traits: Traits) -> None:
        """Begin without a command.

        Args:
            traits: what the vehicle can do; its ``turning_radius_m``, ``turn_rate_rad_s`` and
                ``braking_m_s2``.
        """
        self._traits = traits
        self._circle = TurningCircle(traits.turning_radius_m, traits.turn_rate_rad_s)
        self._commanded: _CommandedSpeed | None = None
        self._stands = False
        self._excess_m_s = 0.0
        self._least_m_s = _CRAWL_M_S
        self._moved: tuple[float, Vector3] | None = None

    def forget(self) -> None:
        """Restart at the speed that is measured then: somebody else has led meanwhile."""
        self._commanded = self._moved = None
        self._stands = False
        self._excess_m_s = 0.0
        self._circle.forget()

    def hold_back(self) -> None:
        """Learn nothing from how slowly it moves: less was commanded than its path allows."""
        self._moved = None

    @property
    def leaves(self) -> bool:
        """Whether it leads away from a point, to come back to it."""
        return self._circle.leaves

    def follow(
        self,
        path: DrivenPath | None,
        end_enu_m: Vector3,
        pursuer: Pursuer,
        limits: Limits,
        arrival_radius_m: float,
        now: float,
    ) -> Setpoint:
        """Return the velocity that leads along.

        Args:
            path: what is left of it; None once the vehicle is at its end.
            end_enu_m: where to come to rest.
            pursuer: the vehicle.
            limits: the speed is kept to theirs.
            arrival_radius_m: how near to the end counts as arrived.
            now: time in seconds.
        """
        end_m = horizontal_norm(subtract(end_enu_m, pursuer.position_enu_m))
        if path is None and self._stand(end_enu_m, end_m, pursuer, arrival_radius_m):
            self._commanded, self._moved, self._excess_m_s = _CommandedSpeed(0.0, now), None, 0.0
            rest = Setpoint(pursuer.position_enu_m, ZERO, ZERO, pursuer.yaw_enu_rad)
            return _along_nose(rest, pursuer.velocity_enu_m_s, pursuer.yaw_enu_rad)
        left_m = end_m if path is None else max(path.left_m, end_m)
        aim = self._aim(path, end_enu_m, pursuer)
        direction, leaves = pursuer.heading, self._circle.must_leave(aim, pursuer)
        if not leaves:
            level = (aim[0], aim[1], pursuer.position_enu_m[2])
            direction = unit_between(pursuer.position_enu_m, level) or direction
        away = wrap_angle(math.atan2(direction[1], direction[0]) - pursuer.yaw_enu_rad)
        self._circle.observe(away, pursuer, now)
        braking_m_s2 = min(self._traits.braking_m_s2, limits.acceleration_horizontal_m_s2)
        most_m_s = limits.speed_horizontal_m_s
        if path is not None:
            most_m_s = min(most_m_s, path.speed_m_s)
        late_m = self._traits.brake_lag_s * pursuer.speed_m_s
        wanted_m_s = _approach_m_s(left_m - late_m, braking_m_s2)
        # A target that it drives away from now comes only after a turn.
        turning_m_s = self._turning_m_s(math.pi if leaves else away, aim, pursuer)
        wanted_m_s = min(most_m_s, wanted_m_s, turning_m_s)
        least_m_s = min(self._least_m_s, limits.speed_horizontal_m_s)
        speed_m_s = self._ease(max(wanted_m_s, least_m_s), most_m_s, pursuer, limits, now)
        speed_m_s = self._push(speed_m_s, pursuer, limits, now)
        course = math.atan2(direction[1], direction[0])
        return Setpoint(aim, scale(direction, speed_m_s), ZERO, course)

    # --- where to ------------------------------------------------------------------------

    def _aim(self, path: DrivenPath | None, end_enu_m: Vector3, pursuer: Pursuer) -> Vector3:
        """Return the point to head for: on the path, and not where it could only be circled."""
        if path is None:
            return end_enu_m
        radius_m, aside_m = self._circle.radius_m, distance(path.ahead(0.0), pursuer.position_enu_m)
        ahead_m = _LOOK_AHEAD_RADII * radius_m + _LOOK_AHEAD_S * pursuer.speed_m_s + aside_m
        aim = path.ahead(ahead_m)
        while ahead_m < path.ahead_m and self._circle.holds(aim, pursuer):
            ahead_m += max(radius_m, _STUCK_WITHIN_M)
            aim = path.ahead(ahead_m)
        return aim

    def _stand(
        self, end_enu_m: Vector3, end_m: float, pursuer: Pursuer, arrival_radius_m: float
    ) -> bool:
        """Whether the vehicle is to stand here: near enough, or as near as this turn brings it."""
        share = end_m / arrival_radius_m
        past = dot(subtract(end_enu_m, pursuer.position_enu_m), pursuer.heading) < 0.0
        past = past or self._circle.holds(end_enu_m, pursuer)
        near_m = _STAND_SHARE * arrival_radius_m
        if self._least_m_s > _CRAWL_M_S:
            # It cannot be brought to the end slowly, so it is stopped in time.
            near_m = max(near_m, min(self._stopping_m(pursuer), 2.0 * arrival_radius_m))
        near = end_m <= near_m or (past and share <= _RESTART_SHARE)
        self._stands = near or (self._stands and share <= _RESTART_SHARE)
        return self._stands

    def _stopping_m(self, pursuer: Pursuer) -> float:
        return stopping_distance_m(pursuer.speed_m_s, 0.2, self._traits.braking_m_s2)

    # --- how fast ------------------------------------------------------------------------

    def _turning_m_s(self, away_rad: float, aim_enu_m: Vector3, pursuer: Pursuer) -> float:
        """Return the speed at which the turn towards a point is not wider than it needs."""
        turn_rate = self._traits.turn_rate_rad_s
        slow_m_s = min(turn_rate * self._circle.radius_m, _TURNING_MAX_M_S)
        if abs(away_rad) >= 0.5 * math.pi:
            return slow_m_s
        reach_m = horizontal_norm(subtract(aim_enu_m, pursuer.position_enu_m))
        sine = max(math.sin(abs(away_rad)), 1e-3)
        return max(slow_m_s, _TURN_MARGIN * turn_rate * reach_m / (2.0 * sine))

    def _ease(
        self, wanted_m_s: float, most_m_s: float, pursuer: Pursuer, limits: Limits, now: float
    ) -> float:
        """Return the speed to send: less at once, more by and by, and never too much for long."""
        commanded = self._commanded
        if commanded is None:
            forward_m_s = dot(pursuer.velocity_enu_m_s, pursuer.heading)
            commanded = _CommandedSpeed(max(forward_m_s, min(wanted_m_s, self._least_m_s)), now)
        dt_s = max(now - commanded.time_s, 0.0)
        eased_m_s2 = max(_EASE_1_S * (most_m_s - commanded.speed_m_s), 0.0)
        up_m_s2 = min(eased_m_s2, limits.acceleration_horizontal_m_s2)
        speed_m_s = min(wanted_m_s, commanded.speed_m_s + up_m_s2 * dt_s)
        self._commanded = _CommandedSpeed(speed_m_s, now)
        # A boat slides outwards in a turn, and so gets faster over ground than commanded.
        beyond_m_s = pursuer.speed_m_s - limits.speed_horizontal_m_s
        excess_m_s = self._excess_m_s + _EXCESS_1_S * beyond_m_s * dt_s
        self._excess_m_s = min(max(excess_m_s, 0.0), 0.5 * speed_m_s)
        excess_m_s = self._excess_m_s + _EXCESS_GAIN * max(beyond_m_s, 0.0)
        return speed_m_s - min(excess_m_s, 0.5 * speed_m_s)

    def _push(self, speed_m_s: float, pursuer: Pursuer, limits: Limits, now: float) -> float:
        """Return the speed, or more if the vehicle does not move at that; remember how much."""
        here = pursuer.position_enu_m
        if self._moved is None or distance(here, self._moved[1]) >= _STUCK_WITHIN_M:
            self._moved = (now, here)
        stuck_s = now - self._moved[0] - _STUCK_AFTER_S
        if stuck_s > 0.0:
            most_m_s = max(min(_PUSH_MAX_M_S, limits.speed_horizontal_m_s), speed_m_s)
            speed_m_s = min(speed_m_s + _PUSH_M_S2 * stuck_s, most_m_s)
            self._least_m_s = max(self._least_m_s, speed_m_s)
        return speed_m_s


def without_turn(setpoint: Setpoint, observation: Observation) -> Setpoint:
    """Return a setpoint that a ground vehicle is stopped by, its end without a turn.

    Args:
        setpoint: what leads to the stop.
        observation: the vehicle; neither its velocity nor its yaw needs to be known.
    """
    if norm(setpoint.velocity_enu_m_s) > _NEXT_TO_NOTHING_M_S:
        return setpoint
    yaw = observation.yaw_enu_rad
    return _along_nose(
        setpoint, observation.velocity_enu_m_s, setpoint.yaw_enu_rad if yaw is None else yaw
    )


def _along_nose(setpoint: Setpoint, velocity_enu_m_s: Vector3 | None, yaw_rad: float) -> Setpoint:
    """Command a very small speed along the nose to what may still roll."""
    if velocity_enu_m_s is not None and horizontal_norm(velocity_enu_m_s) <= _ROLLS_M_S:
        return setpoint
    east, north = math.cos(yaw_rad), math.sin(yaw_rad)
    velocity = (_NEXT_TO_NOTHING_M_S * east, _NEXT_TO_NOTHING_M_S * north, 0.0)
    return replace(setpoint, velocity_enu_m_s=velocity, yaw_enu_rad=yaw_rad)


def _approach_m_s(left_m: float, braking_m_s2: float) -> float:
    """Return a speed from which a vehicle comes to rest in this distance."""
    # Beyond this distance at constant braking, nearer in proportion: no jerk at the end.
    linear_m = braking_m_s2 / _GAIN_1_S**2
    if left_m <= linear_m:
        return _GAIN_1_S * max(left_m, 0.0)
    return math.sqrt(braking_m_s2 * (2.0 * left_m - linear_m))
