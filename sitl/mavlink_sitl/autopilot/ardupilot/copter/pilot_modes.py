"""The modes that a pilot flies: STABILIZE, ALT_HOLD, LOITER and POSHOLD."""

from __future__ import annotations

import math
from dataclasses import replace

from mavlink_sitl.array_ops import Ops
from mavlink_sitl.autopilot.ardupilot.copter import pilot_input
from mavlink_sitl.autopilot.control.controller import sqrt_approach
from mavlink_sitl.autopilot.state.mode import Mode
from mavlink_sitl.exchange import GRAVITY_M_S2, Guidance, Limits, Motors, Vector

STEP_S = 0.05
LOITER_LEAN = 2.0 / 3.0
"""Of ANGLE_MAX, where LOIT_ANG_MAX is 0"""
SLOWEST_LOITER_M_S = 0.2
BRAKE_GAIN_1_S = 1.0
"""Half of PSC_VELXY_P"""
LEANING_TAKES_S = 0.15
"""ATC_INPUT_TC: how the wanted acceleration follows the stick"""
CLIMBS_M_S = 0.0
TAKEN_OFF_M = 0.1
"""A take-off by the stick ends so far below its height"""

_SCALAR = Ops()


class Leans(Mode):
    """A mode in which the sticks lean it."""

    def leaning(self) -> pilot_input.Lean:
        """The lean of this step, north and east."""
        return pilot_input.lean(self.vehicle, pilot_input.lean_limit_rad(self.vehicle))


class Stabilize(Leans):
    """The sticks lean and turn it, and the throttle is thrust."""

    _passed_on: tuple[int, int, bool] | None = None

    def enter(self) -> None:
        """Pass the sticks on."""
        self._passed_on = None
        super().enter()

    def update(self) -> None:
        """Pass the sticks on when they moved."""
        stamp = self.vehicle.radio.stamp(self.vehicle.now_s)
        if stamp == self._passed_on:
            return
        north, east = self.leaning()
        self._passed_on = stamp if north == east == 0.0 else None
        yaw_mode, yaw_rate = pilot_input.yaw(self.vehicle)
        self.drive(
            Guidance(
                motors=Motors.MANUAL,
                throttle=pilot_input.thrust(self.vehicle),
                direct_lean=1.0,
                lean_north=north,
                lean_east=east,
                yaw_mode=yaw_mode,
                yaw_rate_rad_s=yaw_rate,
            )
        )

    def ground_motors(self) -> Motors:
        """The stick decides."""
        return Motors.MANUAL


class HeightMode(Mode):
    """A mode that holds the height; the throttle stick climbs and sinks."""

    def enter(self) -> None:
        """Begin where it is."""
        self._climb: float | None = None
        self._takes_off_to_m: float | None = None
        self.update()

    def ground_motors(self) -> Motors:
        """A raised stick takes off."""
        return Motors.FLY if (self._climb or 0.0) > CLIMBS_M_S else Motors.IDLE

    def pilot_guidance(self) -> Guidance:
        """Turn and climb as the sticks say; to be completed by what it does over ground."""
        copter = self.vehicle
        first = self._climb is None
        self._climb = self._taking_off_m_s(pilot_input.climb_rate_m_s(copter))
        acceleration = max(copter.parameters["PILOT_ACCEL_Z"] / 100.0, 0.1)
        yaw_mode, yaw_rate = pilot_input.yaw(copter)
        return replace(
            self.hold_guidance(),
            velocity_down_m_s=-self._climb,
            limits=replace(self.limits(), acceleration_z_m_s2=acceleration),
            yaw_mode=yaw_mode,
            yaw_rate_rad_s=yaw_rate,
            restart_xy=first,
            restart_z=first,
        )

    def _taking_off_m_s(self, climb_m_s: float) -> float:
        """The climb rate of the stick, or of a take-off by it, which ends at PILOT_TKOFF_ALT."""
        copter, p = self.vehicle, self.vehicle.parameters
        down_m = copter.motion.down_m
        if copter.landed or not copter.armed:
            height_m = min(max(p["PILOT_TKOFF_ALT"] / 100.0, 0.0), 10.0)
            begins = copter.armed and climb_m_s > CLIMBS_M_S and height_m > 0.0
            if not begins and copter.armed and self._takes_off_to_m is not None:
                begins = climb_m_s == 0.0  # the stick is back in its middle already
            else:
                self._takes_off_to_m = down_m - height_m if begins else None
        elif climb_m_s < 0.0:
            self._takes_off_to_m = None
        if self._takes_off_to_m is None:
            return climb_m_s
        left_m = down_m - self._takes_off_to_m
        if left_m <= TAKEN_OFF_M:
            self._takes_off_to_m = None
            return climb_m_s
        most_m_s = p["PILOT_SPEED_UP"] / 100.0
        return max(climb_m_s, min(float(sqrt_approach(left_m, 1.0, 1.0, _SCALAR)), most_m_s))

    def limits(self) -> Limits:
        """The limits of its motion, but for the climb."""
        return self.vehicle.navigator.limits()

    def hand_on(self, guidance: Guidance) -> None:
        """The guidance, if it is new: the restart of the first counts once."""
        was = replace(self.vehicle.wanted, restart_xy=False, restart_z=False)
        if guidance.restart_z or guidance != was:
            self.guide(guidance)


class AltHold(HeightMode, Leans):
    """Leans as the sticks say, holds the height, and drifts."""

    def update(self) -> None:
        """Follow the sticks."""
        guidance = self.pilot_guidance()
        north, east = self.leaning()
        self.hand_on(replace(guidance, direct_lean=1.0, lean_north=north, lean_east=east))


class PilotHeight(HeightMode):
    """LOITER and POSHOLD: the sticks accelerate it, with them centred it stops and holds.

    As AC_Loiter: a full stick leads to LOIT_SPEED; let go of, it slows down by the same drag,
    and brakes after LOIT_BRK_DELAY.
    """

    def enter(self) -> None:
        """Stop, unless the sticks say otherwise."""
        self._velocity = (0.0, 0.0)
        self._acceleration = (0.0, 0.0)
        self._brake_m_s2 = 0.0
        self._centred_s = 0.0
        self._moves = False
        super().enter()

    def update(self) -> None:
        """Follow the sticks."""
        copter = self.vehicle
        guidance = self.pilot_guidance()
        lean = pilot_input.lean(copter, self._lean_limit_rad())
        if copter.landed or not copter.armed:
            self._moves = False
        elif any(lean) and not self._moves:
            m = copter.motion
            self._moves, self._brake_m_s2 = True, 0.0
            self._velocity = (m.velocity_north_m_s, m.velocity_east_m_s)
            self._acceleration = (0.0, 0.0)
        if self._moves:
            guidance = guidance.moving(*self._move(lean, guidance))
            self._moves = any(lean) or any(self._velocity)
        self.hand_on(guidance)

    def limits(self) -> Limits:
        """See `HeightMode`; moved by the sticks it has limits of its own."""
        limits = super().limits()
        if not self._moves:
            return limits
        p = self.vehicle.parameters
        most_m_s2 = max(p["LOIT_ACC_MAX"] / 100.0, 0.1)
        return replace(limits, acceleration_xy_m_s2=most_m_s2, speed_xy_m_s=self._speed_m_s())

    def _lean_limit_rad(self) -> float:
        own = math.radians(self.vehicle.parameters["LOIT_ANG_MAX"])
        most = pilot_input.lean_limit_rad(self.vehicle)
        return min(own, most) if own else LOITER_LEAN * most

    def _speed_m_s(self) -> float:
        return max(self.vehicle.parameters["LOIT_SPEED"] / 100.0, SLOWEST_LOITER_M_S)

    def _move(self, lean: pilot_input.Lean, guidance: Guidance) -> tuple[Vector, Vector]:
        """The velocity and acceleration of this step, NED."""
        p = self.vehicle.parameters
        most_m_s2 = max(p["LOIT_ACC_MAX"] / 100.0, 0.1)
        share = STEP_S / (STEP_S + LEANING_TAKES_S)
        a_n, a_e = (
            was + (min(max(GRAVITY_M_S2 * tangent, -most_m_s2), most_m_s2) - was) * share
            for was, tangent in zip(self._acceleration, lean, strict=True)
        )
        self._acceleration = (a_n, a_e)
        v_n, v_e = self._velocity[0] + a_n * STEP_S, self._velocity[1] + a_e * STEP_S
        speed = math.hypot(v_n, v_e)
        full_m_s2 = GRAVITY_M_S2 * math.tan(self._lean_limit_rad())
        slowing = full_m_s2 * speed / self._speed_m_s() + self._brake(any(lean), speed)
        left = max(speed - slowing * STEP_S, 0.0)
        scale = left / speed if speed else 0.0
        if not any(lean) and left < 1e-2:
            scale = 0.0
        was, self._velocity = self._velocity, (v_n * scale, v_e * scale)
        down = guidance.velocity_down_m_s
        # Between two steps the velocity moves on by itself.
        ahead_n, ahead_e = (self._velocity[i] - was[i] for i in (0, 1))
        return (*was, down), (ahead_n / STEP_S, ahead_e / STEP_S, 0.0)

    def _brake(self, by_stick: bool, speed_m_s: float) -> float:
        """The deceleration by braking, which begins some time after the sticks are let go of."""
        p, now_s = self.vehicle.parameters, self.vehicle.now_s
        jerk = max(p["LOIT_BRK_JERK"] / 100.0, 0.1)
        if by_stick:
            self._centred_s = now_s
        wanted = 0.0
        if now_s - self._centred_s > p["LOIT_BRK_DELAY"]:
            most = max(p["LOIT_BRK_ACCEL"] / 100.0, 0.0)
            wanted = min(float(sqrt_approach(speed_m_s, BRAKE_GAIN_1_S, jerk, _SCALAR)), most)
        change = jerk * STEP_S
        self._brake_m_s2 += min(max(wanted - self._brake_m_s2, -change), change)
        return self._brake_m_s2
