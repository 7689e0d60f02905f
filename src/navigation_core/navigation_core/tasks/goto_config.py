"""Goal and settings of the flight to a point."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

from navigation_core.geometry import Vector3
from navigation_core.limits import Limits


class GotoConfigError(ValueError):
    """A setting of the flight to a point makes no sense."""


@dataclass(frozen=True)
class GotoGoal:
    """The target of the flight.

    Attributes:
        position_enu_m: target in the map frame.
        yaw_enu_rad: yaw to arrive with; None to face the direction of travel.
        max_speed_m_s: maximum ground speed; None or 0 for the configured one.
    """

    position_enu_m: Vector3
    yaw_enu_rad: float | None = None
    max_speed_m_s: float | None = None


@dataclass(frozen=True)
class GotoConfig:
    """Settings of the flight.

    Attributes:
        limits: kinematic limits; a goal's speed replaces the horizontal one.
        may_arm: whether a disarmed vehicle may be armed and taken off.
        may_take_off: whether one that somebody else has armed may be; ``may_arm`` implies it.
        arrival_radius_m: how close counts as arrived.
        arrival_speed_m_s: how slow counts as arrived.
        arrival_dwell_s: for how long both must hold.
        arrival_yaw_rad: how near the yaw must be to that of a goal that names one.
        settle_timeout_s: time to settle at the target, and longest time without progress.
        cancel_timeout_s: longest time that a stop may take.
        stop_speed_m_s: how slow counts as stopped.
        stop_dwell_s: the time over which that is measured.
        takeoff_height_m: greatest height above the ground that a take-off climbs to.
        takeoff_height_min_m: least height above the ground that a take-off climbs to.
        takeoff_climb_rate_m_s: assumed climb rate of a take-off, for the estimate of time.
        arming_time_s: assumed time to arm and spin up, for the estimate of time.
        operation_timeout_s: longest wait for the report of an operation.
        tracking_error_max_m: tracking error at which the setpoint waits for the vehicle.
        tracking_lag_s: time by which a vehicle follows its setpoint as a matter of course; it
            does not count as tracking error.
        following_gain_per_s: how much faster an autopilot flies for each metre that it is behind
            its setpoint (PSC_POSXY_P, MPC_XY_P).
        response_s: time by which the acceleration of an airframe follows (observed on ArduCopter
            and PX4: 0.2 s).
        position_stale_s: age of the position from which the vehicle is held.
        position_timeout_s: age of the position from which the goal is given up.
        step_gap_s: time without a step after which the flight is replanned.
        landed_timeout_s: time on the ground, as the vehicle says, that ends the flight.
        airborne_height_m: height above the ground that counts as flying when the vehicle
            does not say.
        yaw_distance_min_m: horizontal distance below which the yaw is kept if the goal has
            none.
    """

    limits: Limits = dataclasses.field(default_factory=Limits)
    may_arm: bool = False
    may_take_off: bool = False
    arrival_radius_m: float = 0.5
    arrival_speed_m_s: float = 0.3
    arrival_dwell_s: float = 1.0
    arrival_yaw_rad: float = math.radians(5.0)
    settle_timeout_s: float = 20.0
    cancel_timeout_s: float = 10.0
    stop_speed_m_s: float = 0.3
    stop_dwell_s: float = 1.0
    takeoff_height_m: float = 2.5
    takeoff_height_min_m: float = 1.5
    takeoff_climb_rate_m_s: float = 1.0
    arming_time_s: float = 3.0
    operation_timeout_s: float = 60.0
    tracking_error_max_m: float = 3.0
    tracking_lag_s: float = 0.3
    following_gain_per_s: float = 1.0
    response_s: float = 0.2
    position_stale_s: float = 1.0
    position_timeout_s: float = 5.0
    step_gap_s: float = 0.5
    landed_timeout_s: float = 2.0
    airborne_height_m: float = 0.5
    yaw_distance_min_m: float = 1.0

    @property
    def may_leave_ground(self) -> bool:
        """Whether a vehicle that stands on the ground, armed, may be made to leave it."""
        return self.may_arm or self.may_take_off

    def __post_init__(self) -> None:
        """Reject settings that make no sense.

        Raises:
            GotoConfigError: a number is NaN, infinite or negative, or not positive where it
                must be, or the take-off heights are not in order.
        """
        may_be_zero = {
            "arrival_dwell_s",
            "stop_dwell_s",
            "arming_time_s",
            "tracking_lag_s",
            "following_gain_per_s",
            "response_s",
            "yaw_distance_min_m",
        }
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if not isinstance(value, (int, float)) or isinstance(value, bool):
                continue
            sound = value >= 0.0 if field.name in may_be_zero else value > 0.0
            if not (math.isfinite(value) and sound):
                raise GotoConfigError(
                    f"{field.name} is {value}; give a finite number "
                    f"{'of at least' if field.name in may_be_zero else 'above'} 0."
                )
        if self.takeoff_height_min_m > self.takeoff_height_m:
            raise GotoConfigError(
                f"takeoff_height_min_m is {self.takeoff_height_min_m} m, above takeoff_height_m, "
                f"{self.takeoff_height_m} m; give a minimum that is not above it."
            )
