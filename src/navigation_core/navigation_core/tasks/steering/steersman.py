"""Leads a vehicle by velocity commands: one command in, one setpoint out.

A command is reduced to what the limits, obstacles, late setpoints and the bounds of the flight
allow, in this order, and the reference of the vehicle follows what is left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from navigation_core.geometry import (
    ZERO,
    KinematicState,
    Vector3,
    distance,
    dot,
    horizontal_norm,
    norm,
    scale,
)
from navigation_core.safety.late_setpoints import speed_share
from navigation_core.safety.speed_at_bounds import Braking, SpeedAtBounds
from navigation_core.safety.target_checks import FlightVolume
from navigation_core.tasks.conditions import Located
from navigation_core.tasks.inputs.velocity_command import VelocityCommand, VelocityFrame
from navigation_core.tasks.intents import Fly, Intent, Wait
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.leading.path_follower import cruise_limits
from navigation_core.tasks.leading.pursuit import without_turn
from navigation_core.tasks.leading.run_out_limiter import RunOutLimiter
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.steering.driven_reference import DrivenReference
from navigation_core.tasks.steering.flown_reference import FlownReference
from navigation_core.tasks.steering.obstruction import FREE, Obstruction, Obstructions

__all__ = ["Steersman", "VelocityTerms"]

# A reference this many times the greatest tracking error away is no start.
_START_ERROR_SHARE = 1.5
# A vehicle that is left no more than the first share of what is asked for is held back, and is so
# until it is left more than the second.
_HELD_BACK_SHARE, _RELEASED_SHARE = 0.1, 0.3
_ASKED_M_S = 0.05
# A bound that leaves less than this share of the present speed stops the vehicle over ground.
_KEPT_SHARE = 0.95


@dataclass(frozen=True)
class VelocityTerms:
    """How to follow.

    Attributes:
        flight: settings, traits, obstacles, and what a replaced task sent last.
        volume: the flight volume.
        fence_margin_m: distance that is kept to the vehicle's own fence.
        command_timeout_s: age from which a command counts no more.
        max_speed_m_s: highest ground speed; None or 0 for the configured one.
    """

    flight: FlightTerms
    volume: FlightVolume
    fence_margin_m: float = 1.0
    command_timeout_s: float = 0.5
    max_speed_m_s: float | None = None


class Steersman:
    """Steers one vehicle; it continues from its last setpoint.

    Attributes:
        held_back: why the vehicle does not move although it is commanded to; empty while it does.
        obstruction: what obstacles left of the last command.
    """

    def __init__(self, terms: VelocityTerms) -> None:
        """Prepare."""
        flight = terms.flight
        self._terms = terms
        self._traits = traits = flight.traits
        limits = self._limits = cruise_limits(flight.config.limits, terms.max_speed_m_s, traits)
        self._flown = FlownReference(flight.config, limits)
        self._driven = DrivenReference(traits, limits)
        self._obstructions = Obstructions(flight.avoidance, traits, limits)
        self._run_out_limiter = RunOutLimiter(flight.avoidance, traits, limits)
        braking_m_s2 = limits.acceleration_horizontal_m_s2
        if not traits.flies:
            braking_m_s2 = min(traits.braking_m_s2, braking_m_s2)
        lag_s = flight.config.tracking_lag_s if traits.flies else traits.brake_lag_s
        # Towards a bound it is so slow that it also stops before it if no setpoint follows.
        reaction_s = max(self._flown.ease_s, traits.setpoint_timeout_s) + lag_s
        self._braking = Braking(
            braking_m_s2,
            limits.acceleration_vertical_m_s2,
            reaction_s,
            traits.return_turn_m,
            traits.setpoint_timeout_s,
        )
        # Motion in any direction that is under way already is slowed down with this margin.
        self._last_brake = replace(self._braking, reaction_s=lag_s, turn_m=0.0)
        self._inherited = flight.handover.commanded
        self._sent: KinematicState | None = None
        self._begun = False
        self._is_held_back = False
        self.held_back = ""
        self.obstruction: Obstruction = FREE

    @property
    def commanded(self) -> KinematicState | None:
        """State of the setpoint sent last, by a replaced task or here; None without one."""
        return self._sent or self._inherited

    @property
    def commanded_yaw_enu_rad(self) -> float | None:
        """Yaw of the setpoint sent last; None before the first."""
        if self._sent is None:
            return self._terms.flight.handover.yaw_enu_rad
        return self._flown.yaw_enu_rad if self._traits.flies else self._driven.course_enu_rad

    @property
    def sensor_patience_s(self) -> float:
        """For how long the obstacle sensor may be silent; infinite without one."""
        return self._obstructions.patience_s

    def forget(self) -> None:
        """Begin again from the measured motion: what was sent is past."""
        self._begun = False
        self._inherited = None

    def hold(self, observation: Observation) -> Intent:
        """Command a standstill by velocity, without a position."""
        self.held_back = ""
        yaw = observation.yaw_enu_rad
        if yaw is None:
            return Wait()
        sent = self._sent or KinematicState(observation.position_enu_m or ZERO)
        if self._sent is None:
            # It was not steered yet. A PX4 that gets no setpoint then returns by itself.
            self._begin(sent, yaw)
        self._begun = False
        self._sent = KinematicState(sent.position_enu_m)
        self._flown.stand(self._sent.position_enu_m)
        setpoint = self._flown.setpoint
        if not self._traits.flies:
            return Fly(without_turn(setpoint, observation), True)
        return Fly(setpoint, True)

    def lead(
        self, known: Located, observation: Observation, command: VelocityCommand | None, dt_s: float
    ) -> Fly:
        """Return the setpoint that follows a command.

        Args:
            known: where the vehicle is.
            observation: the vehicle.
            command: the command, None to stand.
            dt_s: time since the last setpoint.
        """
        here, yaw = known.state, known.yaw_enu_rad
        if not self._begun:
            self._begin(here, yaw)
        self.held_back = ""
        wanted = self._wanted(command, yaw)
        judged = (
            self._obstructions.judge(way, here, observation) for way in self._ways(wanted, yaw)
        )
        self.obstruction = min(judged, key=lambda each: each.share)
        allowed = self._allowed(wanted, here, yaw, observation)
        self._judge(wanted, allowed)
        factor = self._obstructions.brake_factor if self.obstruction.brakes else 1.0
        if not self._traits.flies:
            speed_m_s = math.copysign(norm(allowed), self._driven.wanted_m_s(command))
            self._driven.advance(dt_s, speed_m_s, command, yaw, factor)
            answer = self._driven.answer(command, here, yaw, observation)
            self._sent = KinematicState(here.position_enu_m, answer.setpoint.velocity_enu_m_s)
            return answer
        most = self._limits.yaw_rate_rad_s
        rate = 0.0 if command is None else min(max(command.yaw_rate_rad_s, -most), most)
        self._flown.advance(dt_s, allowed, rate, here, yaw, factor)
        self._sent = self._flown.state
        return Fly(self._run_out_limiter.limited(self._flown.setpoint, observation))

    # --- inside ------------------------------------------------------------------------

    def _begin(self, here: KinematicState, yaw_enu_rad: float) -> None:
        """Continue from what a replaced task sent, or from the measured motion."""
        state, yaw = here, yaw_enu_rad
        inherited, self._inherited = self._inherited, None
        far_m = _START_ERROR_SHARE * self._terms.flight.config.tracking_error_max_m
        if (
            inherited is not None
            and inherited.is_finite
            and distance(inherited.position_enu_m, here.position_enu_m) <= far_m
        ):
            state, commanded_yaw_enu_rad = inherited, self._terms.flight.handover.yaw_enu_rad
            yaw = yaw_enu_rad if commanded_yaw_enu_rad is None else commanded_yaw_enu_rad
        self._flown.begin(state, yaw)
        self._driven.begin(here, yaw_enu_rad)
        self._begun = True

    def _wanted(self, command: VelocityCommand | None, yaw_enu_rad: float) -> Vector3:
        """Return the velocity that is asked for, within the speed limits."""
        if command is None:
            return ZERO
        if self._traits.flies:
            return self._limits.clip_velocity(command.velocity_enu_m_s(yaw_enu_rad))
        speed_m_s = self._driven.wanted_m_s(command)
        if speed_m_s < 0.0 and not self._traits.drives_by_turn_rate:
            self.held_back = f"This {self._traits.name} cannot be driven backwards by setpoints."
            return ZERO
        course_rad = yaw_enu_rad
        if command.frame is VelocityFrame.MAP:
            course_rad = math.atan2(command.linear_m_s[1], command.linear_m_s[0])
        return (speed_m_s * math.cos(course_rad), speed_m_s * math.sin(course_rad), 0.0)

    def _ways(self, wanted: Vector3, yaw_enu_rad: float) -> tuple[Vector3, ...]:
        """Return the velocities to check: what drives moves along its nose until it has turned."""
        if self._traits.flies or wanted == ZERO:
            return (wanted,)
        nose = (math.cos(yaw_enu_rad), math.sin(yaw_enu_rad), 0.0)
        ahead = math.copysign(norm(wanted), wanted[0] * nose[0] + wanted[1] * nose[1])
        if not self._traits.drives_by_turn_rate:
            ahead = abs(ahead)
        return (wanted, scale(nose, ahead))

    def _allowed(
        self,
        wanted: Vector3,
        here: KinematicState,
        yaw_enu_rad: float,
        observation: Observation,
    ) -> Vector3:
        """Return the velocity, slower for obstacles, for late setpoints and near the bounds."""
        slowed = scale(wanted, self.obstruction.share * speed_share(observation.late_s))
        home, ground_m = observation.home_enu_m, observation.ground_enu_m
        room = SpeedAtBounds(
            self._terms.volume,
            observation.fence,
            ground_m if home is None else home[2],
            self._terms.fence_margin_m,
            self._traits.flies,
        )
        moving = self._flown.state if self._traits.flies else here
        if moving is not None and dot(moving.velocity_enu_m_s, wanted) > 0.0:
            speed_m_s = horizontal_norm(moving.velocity_enu_m_s)
            kept = room.reduced(
                moving.velocity_enu_m_s, here.position_enu_m, ground_m, self._last_brake
            )
            if horizontal_norm(kept) < _KEPT_SHARE * speed_m_s:
                slowed = (0.0, 0.0, slowed[2])
        if self._traits.flies:
            return room.reduced(slowed, here.position_enu_m, ground_m, self._braking)
        speed_m_s = norm(slowed)
        for way in self._ways(slowed, yaw_enu_rad):
            reduced = room.reduced(way, here.position_enu_m, ground_m, self._braking)
            speed_m_s = min(speed_m_s, norm(reduced))
        length = norm(slowed)
        return scale(slowed, speed_m_s / length) if length > 0.0 else ZERO

    def _judge(self, wanted: Vector3, allowed: Vector3) -> None:
        """Find out why the vehicle does not move although it is commanded to."""
        share = _RELEASED_SHARE if self._is_held_back else _HELD_BACK_SHARE
        asked_m_s = norm(wanted)
        self._is_held_back = asked_m_s > _ASKED_M_S and norm(allowed) <= share * asked_m_s
        if self._is_held_back:
            self.held_back = self.obstruction.reason or (
                "The commanded velocity leads out of the flight volume or the vehicle's fence."
            )
