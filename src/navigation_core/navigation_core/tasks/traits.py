"""The capabilities of a vehicle type, as tasks see them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from navigation_core.safety.late_setpoints import Following

# As slow as this a ground vehicle still drives: PX4's simulated rover not below 0.8 m/s (observed).
_SLOW_M_S = 0.8


@dataclass(frozen=True)
class Traits:
    """The capabilities of a vehicle type.

    Attributes:
        name: for sentences: "copter", "rover".
        flies: whether it leaves the ground.
        hovers: whether it can stand still away from the ground, or on it. A plane cannot.
        control_before_takeoff: whether it must be in the mode in which it follows setpoints
            before it takes off (ArduCopter), or must not (PX4).
        lands_itself: whether it has a mode or command that lands it where it is.
        circle_radius_m: radius of the circle that it flies instead of standing still.
        circles_left: whether it flies its circles to the left, counter-clockwise.
        airspeed_m_s: that it keeps unless another is asked for; 0 if that is not known.
        airspeed_min_m_s: the least that it can be asked for; 0 if that is not known.
        airspeed_max_m_s: the greatest; 0 if that is not known.
        circle_acceleration_m_s2: with which it may turn on a circle that it is sent to; 0 if that
            is not known: then it is sent to its usual circles only.
        reposition_keeps_mode: whether it can be sent to a place without a change of mode, so that
            it can be sent on again and again and yet be taken over.
        sinks_along_leg: whether it descends to a target gradually on its way there, not at once.
        turning_radius_m: least radius of a turn on the ground; 0 if it can turn on the spot.
        turn_rate_rad_s: fastest turn on the ground, at any speed.
        arrival_radius_m: how near to a point it can be expected to stop at all.
        speed_max_m_s: how fast its autopilot drives at most.
        acceleration_m_s2: how fast its autopilot speeds up at most, over ground.
        climb_acceleration_m_s2: the same, up and down.
        braking_m_s2: how hard it is meant to brake on the ground.
        brake_lag_s: by which time its speed is late then.
        height_min_m: least height above the ground that it is sent to.
        takeoff_height_m: height above the ground of a take-off when none is asked for.
        setpoint_timeout_s: for how long it continues with the velocity and the acceleration of the
            last setpoint when none follows; 0 if it does not.
        return_turn_m: radius of the turn with which it drives back by itself after that time; 0 if
            it stops instead.
        following: how it comes to a setpoint whose target it moves on by itself in that time; None
            if it does not move the target.
        drives_by_turn_rate: whether it follows a speed along its nose, also backwards, and a
            turn rate.
    """

    name: str = "copter"
    flies: bool = True
    hovers: bool = True
    control_before_takeoff: bool = True
    lands_itself: bool = True
    circle_radius_m: float = 0.0
    circles_left: bool = False
    airspeed_m_s: float = 0.0
    airspeed_min_m_s: float = 0.0
    airspeed_max_m_s: float = 0.0
    circle_acceleration_m_s2: float = 0.0
    reposition_keeps_mode: bool = False
    sinks_along_leg: bool = False
    turning_radius_m: float = 0.0
    turn_rate_rad_s: float = 1.0
    arrival_radius_m: float = 0.0
    speed_max_m_s: float = math.inf
    acceleration_m_s2: float = math.inf
    climb_acceleration_m_s2: float = math.inf
    braking_m_s2: float = 0.6
    brake_lag_s: float = 0.3
    height_min_m: float = 0.0
    takeoff_height_m: float = 0.0
    setpoint_timeout_s: float = 0.0
    return_turn_m: float = 0.0
    following: Following | None = None
    drives_by_turn_rate: bool = False

    @property
    def target_margin_m(self) -> float:
        """Least distance of its targets to a bound, so that it turns back before that bound."""
        if self.return_turn_m <= 0.0:
            return 0.0
        return self.return_turn_m + _SLOW_M_S * self.setpoint_timeout_s


COPTER = Traits()
