"""Setpoints that are safe if none follows, and a lower speed while setpoints are late.

The server may stop sending setpoints at any moment: the process is killed, the machine hangs. Then
the vehicle continues with the last one until its own timeout. Near obstacles that run-out
(:mod:`navigation_core.safety.run_out`) is part of the stopping distance, so the flight is slower
there, and so it is towards a bound of the flight volume or of the vehicle's fence. A setpoint
whose velocity would lead too near is sent with its position alone, at which the vehicle comes to
rest.
"""

from __future__ import annotations

import math
from dataclasses import replace

from navigation_core.geometry import ZERO, KinematicState, Vector3, scale
from navigation_core.limits import Limits
from navigation_core.planning.conflicts import clearance_at_m
from navigation_core.safety.hidden_corners import speed_past_corners_m_s
from navigation_core.safety.late_setpoints import LATE_S, held, speed_share
from navigation_core.safety.run_out import (
    run_out_is_clear,
    safe_speed_beside_m_s,
    safe_speed_m_s,
)
from navigation_core.safety.speed_at_bounds import Bounds, Braking, SpeedAtBounds
from navigation_core.tasks.conditions import measured_state
from navigation_core.tasks.intents import Setpoint
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traits import Traits

__all__ = ["RunOutLimiter"]

# As slow as this, what flies follows positions alone well enough: it lags by a second's distance
# (ArduCopter's PSC_POSXY_P is 1, PX4's MPC_XY_P 0.95).
_BY_POSITION_M_S = 1.0
# Ground vehicles follow no positions, and must continue, or they would never arrive.
_CREEP_M_S = 0.2
_ROUNDING = 1.02


class RunOutLimiter:
    """Limits the setpoints of one goal to what is safe if none follows, or if they are late."""

    def __init__(
        self,
        avoidance: AvoidanceConfig | None,
        traits: Traits,
        limits: Limits,
        bounds: Bounds | None = None,
    ) -> None:
        """Prepare.

        Args:
            avoidance: how to keep away from obstacles; None to fly straight.
            traits: what the vehicle can do.
            limits: of the flight.
            bounds: within which a run-out ends; None for anywhere.
        """
        self._avoidance = avoidance
        self._traits = traits
        self._limits = limits
        self._bounds = bounds
        braking_m_s2, reaction_s = limits.acceleration_horizontal_m_s2, traits.setpoint_timeout_s
        if not traits.flies:
            braking_m_s2 = min(braking_m_s2, traits.braking_m_s2)
            reaction_s += traits.brake_lag_s
        self._braking = Braking(
            braking_m_s2,
            limits.acceleration_vertical_m_s2,
            reaction_s,
            traits.return_turn_m,
            traits.setpoint_timeout_s,
        )
        self._least_m_s = _BY_POSITION_M_S if traits.flies else _CREEP_M_S

    def speed_share(self, carrot: Carrot, observation: Observation) -> float:
        """Return the share of its planned speed that a setpoint may have now."""
        share = speed_share(observation.late_s)
        if not self._traits.flies:
            return share  # its setpoint is a velocity, see limited
        velocity = carrot.nominal.velocity_enu_m_s
        speed = math.hypot(*velocity)
        if share < 1.0 and self._is_approached(carrot, observation):
            share = max(share, min(self._least_m_s / max(speed, self._least_m_s), 1.0))
        if speed <= self._least_m_s:
            return share
        place = carrot.state.position_enu_m
        safe_m_s = self._safe_m_s(place, velocity, speed, observation)
        if self._avoidance is not None:
            corners, reaction_s = observation.corners_enu_m, self._avoidance.reaction_s
            braking_m_s2 = self._braking.horizontal_m_s2
            past_m_s = speed_past_corners_m_s(place, velocity, corners, reaction_s, braking_m_s2)
            safe_m_s = min(safe_m_s, past_m_s)
        return min(share, max(safe_m_s, self._least_m_s) / speed)

    def limited(self, setpoint: Setpoint, observation: Observation) -> Setpoint:
        """Return a setpoint as it may be sent."""
        if observation.late_s > LATE_S:
            # An acceleration that is not taken back in time makes the vehicle faster and faster.
            setpoint = replace(setpoint, acceleration_enu_m_s2=ZERO)
        position, velocity = setpoint.position_enu_m, setpoint.velocity_enu_m_s
        speed = math.hypot(*velocity)
        if not self._traits.flies:
            safe_m_s = min(
                self._safe_m_s(position, velocity, speed, observation),
                self._safe_ahead_m_s(speed, observation),
            )
            allowed_m_s = max(safe_m_s, self._least_m_s)
            return _slower(
                setpoint,
                min(allowed_m_s / speed, speed_share(observation.late_s)) if speed else 1.0,
            )
        safe_m_s = self._safe_m_s(position, velocity, speed, observation)
        if speed > _ROUNDING * safe_m_s:
            share = 0.0 if speed <= _ROUNDING * self._least_m_s else safe_m_s / speed
            return _slower(setpoint, share)
        led = KinematicState(position, velocity, setpoint.acceleration_enu_m_s2)
        if self._traits.following is not None and self._traits.setpoint_timeout_s > 0.0:
            led = held(led, self._traits.following, self._traits.setpoint_timeout_s)
        if self._avoidance is None or run_out_is_clear(
            position,
            led,
            observation.obstacles_now,
            observation.moving,
            self._limits,
            self._avoidance.brake_clearance_m,
            self._traits.setpoint_timeout_s,
        ):
            return replace(
                setpoint,
                position_enu_m=led.position_enu_m,
                velocity_enu_m_s=led.velocity_enu_m_s,
                acceleration_enu_m_s2=led.acceleration_enu_m_s2,
            )
        return replace(setpoint, acceleration_enu_m_s2=ZERO)

    def _is_approached(self, carrot: Carrot, observation: Observation) -> bool:
        """Whether an obstacle comes to where the vehicle would wait until it is in time again.

        Then waiting is no safer than continuing slowly.
        """
        if self._avoidance is None:
            return False
        limit_m = self._avoidance.conflict_clearance_m
        here = carrot.state.position_enu_m
        return clearance_at_m(here, observation.obstacles, limit_m) < limit_m

    def _safe_m_s(
        self, position: Vector3, velocity: Vector3, speed_m_s: float, observation: Observation
    ) -> float:
        """Return how fast a setpoint may be for its run-out; infinite if that is free."""
        if self._traits.setpoint_timeout_s <= 0.0:
            return math.inf
        if not self._traits.flies and observation.position_enu_m is not None:
            position = measured_state(observation).position_enu_m
        safe_m_s = math.inf
        if self._bounds is not None:
            home, ground_m = observation.home_enu_m, observation.ground_enu_m
            home_z_m = ground_m if home is None else home[2]
            room = SpeedAtBounds(
                self._bounds.volume,
                observation.fence,
                home_z_m,
                self._bounds.fence_margin_m,
                self._traits.flies,
            )
            level = (velocity[0], velocity[1], 0.0)
            # Where the autopilot moves its target on, climbs are led by the position alone.
            led = velocity if self._traits.following is None else level
            share = room.run_out_share(position, led, ground_m, self._braking)
            safe_m_s = math.inf if share >= 1.0 else share * speed_m_s
        if self._avoidance is None:
            return safe_m_s
        return min(safe_m_s, self._clear_m_s(position, velocity, self._avoidance, observation))

    def _clear_m_s(
        self,
        position: Vector3,
        velocity: Vector3,
        avoidance: AvoidanceConfig,
        observation: Observation,
    ) -> float:
        """Return how fast a setpoint may be to run out clear of obstacles; infinite if it does."""
        clearance_m = avoidance.brake_clearance_m
        timeout_s = self._traits.setpoint_timeout_s
        flies = self._traits.flies
        safe_m_s = safe_speed_m_s(
            position,
            velocity,
            # Passing something that moves at its time is judged below.
            observation.obstacles_now if flies else observation.obstacles,
            self._limits,
            clearance_m,
            timeout_s,
            observation.obstacles_reach_m,
        )
        if not flies:
            return safe_m_s  # it cannot leave sideways: where it is slow, it may be boxed in
        beside_m_s = safe_speed_beside_m_s(
            position, velocity, observation.moving, self._limits, clearance_m, timeout_s
        )
        return min(safe_m_s, beside_m_s)

    def _safe_ahead_m_s(self, speed_m_s: float, observation: Observation) -> float:
        """Return how fast a rover or boat may be towards the obstacles that its nose points at.

        Commanded to turn away from an obstacle, it continues along its nose until its wheels, or
        its rudder, have turned.
        """
        yaw, here = observation.yaw_enu_rad, observation.position_enu_m
        if self._avoidance is None or yaw is None or here is None:
            return math.inf
        return safe_speed_m_s(
            measured_state(observation).position_enu_m,
            (speed_m_s * math.cos(yaw), speed_m_s * math.sin(yaw), 0.0),
            observation.obstacles_now,
            self._limits,
            self._avoidance.brake_clearance_m,
            self._traits.brake_lag_s + observation.late_s,
        )


def _slower(setpoint: Setpoint, share: float) -> Setpoint:
    if share >= 1.0:
        return setpoint
    return replace(
        setpoint,
        velocity_enu_m_s=scale(setpoint.velocity_enu_m_s, max(share, 0.0)),
        acceleration_enu_m_s2=ZERO,
    )
