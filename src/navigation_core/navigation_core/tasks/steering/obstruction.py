"""The speed that obstacles leave to a velocity that nobody planned.

The same layers as on a path (:mod:`navigation_core.safety.braking`, ``run_out``): the vehicle is
stopped when its stopping distance leads too near to an obstacle, and is never faster than its
run-out allows if no setpoint follows. It does not go around an obstacle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from navigation_core.geometry import KinematicState, Vector3, dot, norm
from navigation_core.limits import Limits
from navigation_core.planning.conflicts import MotionSamples
from navigation_core.safety.braking import must_brake
from navigation_core.safety.run_out import safe_speed_beside_m_s, safe_speed_m_s
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traits import Traits

__all__ = ["FREE", "Obstruction", "Obstructions"]


@dataclass(frozen=True)
class Obstruction:
    """How much of a commanded velocity obstacles allow.

    Attributes:
        share: of its speed that may be flown.
        brakes: whether the vehicle is to stop as hard as it may.
        reason: why it is slower, as a sentence; empty if it is not.
        is_silent: whether the reason is a sensor that is not heard.
    """

    share: float = 1.0
    brakes: bool = False
    reason: str = ""
    is_silent: bool = False


FREE = Obstruction()


class Obstructions:
    """Looks at the obstacles for one goal."""

    def __init__(self, avoidance: AvoidanceConfig | None, traits: Traits, limits: Limits) -> None:
        """Prepare.

        Args:
            avoidance: the clearances; None if no obstacles are known or sensed.
            traits: what the vehicle can do.
            limits: what a brake keeps to.
        """
        self._avoidance = avoidance
        self._traits = traits
        self._limits = limits

    @property
    def brake_factor(self) -> float:
        """How many times harder than the limits the vehicle may brake in an emergency."""
        return 1.0 if self._avoidance is None else self._avoidance.emergency_factor

    @property
    def patience_s(self) -> float:
        """For how long the sensor may be silent; infinite without one."""
        return math.inf if self._avoidance is None else self._avoidance.blocked_timeout_s

    def judge(
        self, velocity_enu_m_s: Vector3, here: KinematicState, observation: Observation
    ) -> Obstruction:
        """Return what obstacles leave of a velocity.

        Args:
            velocity_enu_m_s: the velocity that is asked for.
            here: the measured state.
            observation: the obstacles.
        """
        config = self._avoidance
        if config is None:
            return FREE
        if not observation.obstacles_age_s <= config.sensor_timeout_s:
            age_s = observation.obstacles_age_s
            since = f"been silent for {age_s:.1f} s" if math.isfinite(age_s) else "not reported yet"
            return Obstruction(0.0, False, f"The obstacle sensor has {since}.", True)
        near = f"An obstacle is nearer than {config.brake_clearance_m:g} m, or would be."
        acts = must_brake(
            MotionSamples.at(here),
            observation.obstacles,
            self._limits,
            config.brake_clearance_m,
            config.reaction_s,
        )
        if acts[0] and dot(velocity_enu_m_s, here.velocity_enu_m_s) >= 0.0:
            return Obstruction(0.0, True, near)
        speed_m_s = norm(velocity_enu_m_s)
        safe_m_s = self._safe_m_s(config, velocity_enu_m_s, here, observation)
        if speed_m_s <= safe_m_s:
            return FREE
        return Obstruction(safe_m_s / speed_m_s, bool(acts[0]), near)

    def _safe_m_s(
        self,
        config: AvoidanceConfig,
        velocity_enu_m_s: Vector3,
        here: KinematicState,
        observation: Observation,
    ) -> float:
        # At least the reaction to a command, where no setpoint timeout says more.
        timeout_s = max(self._traits.setpoint_timeout_s, config.reaction_s)
        safe_m_s = safe_speed_m_s(
            here.position_enu_m,
            velocity_enu_m_s,
            observation.obstacles,
            self._limits,
            config.brake_clearance_m,
            timeout_s,
            observation.obstacles_reach_m,
        )
        if not self._traits.flies:
            return safe_m_s
        beside_m_s = safe_speed_beside_m_s(
            here.position_enu_m,
            velocity_enu_m_s,
            observation.moving,
            self._limits,
            config.brake_clearance_m,
            timeout_s,
        )
        return min(safe_m_s, beside_m_s)
