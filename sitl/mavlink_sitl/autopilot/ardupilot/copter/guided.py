"""GUIDED: take-off, and setpoints of every kind.

Each kind of setpoint as the firmware flies it, from the recordings `copter_setpoints`,
`copter_takeoff_mix` and `copter_guided`:

* a position alone stays until another target comes;
* everything with a velocity or an acceleration runs out after GUID_TIMEOUT: then the
  velocity, acceleration and turn are zero, and the vehicle brakes and holds;
* a position with a velocity moves on with it until then;
* speeds of DO_CHANGE_SPEED last until another kind of target comes, or another mode;
* a combination that is not one of these (a mask that ignores only x, or everything) stops
  the vehicle where it is;
* of these nothing but NAV_TAKEOFF leaves the ground;
* while it is paused, targets are taken and not flown: only resuming, or another mode, ends that.
"""

from __future__ import annotations

import math
from dataclasses import replace
from enum import Enum
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.state.mode import Mode
from mavlink_sitl.autopilot.state.setpoint import Setpoint, SetpointFrame, turned
from mavlink_sitl.exchange import ZERO, Guidance, Motors, Vector, YawMode

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander
    from mavlink_sitl.autopilot.personality import ModeSpec


ARMING_DELAY_S = 2.3
"""From arming to the motors turning: no take-off before."""
TAKEOFF_MARGIN_M = 0.1
TAKEOFF_SPEED_M_S = 0.25
"""A take-off is complete within this much of its height, below this climb rate"""


class Submode(Enum):
    """The submode of GUIDED."""

    TAKEOFF = "take-off"
    POSITION = "position"
    POSITION_VELOCITY = "position and velocity"
    VELOCITY = "velocity"
    ACCELERATION = "acceleration"


class Guided(Mode):
    """Flies to and along setpoints.

    Attributes:
        submode: what it is busy with.
        target: the setpoint in force, in LOCAL, for POSITION_TARGET_LOCAL_NED.
    """

    def __init__(self, copter: Commander, spec: ModeSpec) -> None:
        super().__init__(copter, spec)
        self.submode = Submode.VELOCITY
        self.target = Setpoint(SetpointFrame.LOCAL, velocity_m_s=ZERO)
        self._expires_s = math.inf
        self._takeoff_pending = False
        self._paused = False
        self._took_off = False

    @property
    def wanted_velocity_m_s(self) -> Vector | None:
        """The velocity of the setpoint, NED, that AC_Avoid looks at.

        Only where no position comes with it: mode_guided.cpp, velaccel_control_run alone asks it.
        """
        return self.target.velocity_m_s if self.submode is Submode.VELOCITY else None

    def enter(self) -> None:
        """Stop and hold; no old setpoint is followed again, and no pause lasts."""
        self._paused = False
        self._stop()

    def pause(self) -> None:
        """DO_PAUSE_CONTINUE 0: stop and hold until DO_PAUSE_CONTINUE 1, whatever target comes."""
        # The desired motion is slowed down, which is ahead of the vehicle.
        self.guide(replace(self.hold_guidance(), restart_xy=False, restart_z=False))
        self._paused = True

    def go_on(self) -> None:
        """DO_PAUSE_CONTINUE 1: on to the latest target, also one that came in the meantime."""
        if not self._paused:
            return
        self._paused = False
        if self.submode is Submode.TAKEOFF:
            if not self._takeoff_pending:
                self.guide(self._takeoff_guidance())
        else:
            self.guide(replace(self._guidance(self.target), restart_xy=True, restart_z=True))
        self.update()

    def guide(self, guidance: Guidance) -> None:
        """See `Mode`; paused, it holds."""
        if not self._paused:
            super().guide(guidance)

    def _stop(self) -> None:
        self.submode = Submode.VELOCITY
        self.target = Setpoint(SetpointFrame.LOCAL, velocity_m_s=ZERO)
        self._expires_s = math.inf
        self._takeoff_pending = self._took_off = False
        self.guide(self.hold_guidance())

    @property
    def taking_off(self) -> bool:
        """Whether a take-off is in progress."""
        return self.submode is Submode.TAKEOFF

    def take_off(self, down_m: float) -> None:
        """Climb straight up to a height, once the motors turn."""
        motion = self.vehicle.motion
        self.submode = Submode.TAKEOFF
        self.target = Setpoint(SetpointFrame.LOCAL, position_m=ZERO)
        self._expires_s = math.inf
        self._takeoff_pending = True
        self._takeoff_down_m = down_m
        self._takeoff_at = (motion.north_m, motion.east_m)

    def setpoint(self, setpoint: Setpoint) -> None:
        """Set a new target; everything in it is finite."""
        setpoint = self._to_local(setpoint)
        position, velocity = setpoint.position_m, setpoint.velocity_m_s
        if position is not None and velocity is not None:
            self._take(Submode.POSITION_VELOCITY, setpoint)
        elif velocity is not None:
            self._take(Submode.VELOCITY, setpoint)
        elif position is not None and setpoint.acceleration_m_s2 is None:
            self._take(Submode.POSITION, setpoint)
        elif position is None and setpoint.acceleration_m_s2 is not None:
            self._take(Submode.ACCELERATION, setpoint)
        else:
            self._stop()

    def _to_local(self, setpoint: Setpoint) -> Setpoint:
        motion = self.vehicle.motion
        if setpoint.frame is SetpointFrame.LOCAL:
            return setpoint
        velocity, acceleration = setpoint.velocity_m_s, setpoint.acceleration_m_s2
        yaw = setpoint.yaw_rad
        if setpoint.frame is SetpointFrame.BODY:
            velocity = velocity and turned(velocity, motion.yaw_rad)
            acceleration = acceleration and turned(acceleration, motion.yaw_rad)
            yaw = None if yaw is None else yaw + motion.yaw_rad
        return Setpoint(
            SetpointFrame.LOCAL,
            setpoint.place_ned_m(motion),
            velocity,
            acceleration,
            yaw,
            setpoint.yaw_rate_rad_s,
        )

    def _take(self, submode: Submode, setpoint: Setpoint) -> None:
        restart = submode is not self.submode or self._took_off
        if restart:
            # Each kind of target begins with the parameters' speeds, seen after a take-off.
            self.vehicle.navigator.forget_speeds()
        self._took_off = False
        self.submode = submode
        self.target = setpoint
        self._takeoff_pending = False
        position = submode is Submode.POSITION
        timeout_s = self.vehicle.parameters["GUID_TIMEOUT"]
        self._expires_s = math.inf if position else self.vehicle.now_s + timeout_s
        self.guide(replace(self._guidance(setpoint), restart_xy=restart, restart_z=restart))

    def _guidance(self, setpoint: Setpoint) -> Guidance:
        tracks_velocity = float(self.submode is not Submode.ACCELERATION)
        yaw_mode, yaw = YawMode.LOOK_AHEAD, 0.0
        if setpoint.yaw_rad is not None:
            yaw_mode, yaw = YawMode.ANGLE, setpoint.yaw_rad
        elif setpoint.yaw_rate_rad_s is not None:
            yaw_mode = YawMode.RATE
        guidance = Guidance(
            motors=Motors.FLY,
            track_velocity_xy=tracks_velocity,
            track_velocity_z=tracks_velocity,
            straight=float(self.submode is Submode.POSITION),
            yaw_mode=yaw_mode,
            yaw_rad=yaw,
            yaw_rate_rad_s=setpoint.yaw_rate_rad_s or 0.0,
            limits=self.vehicle.navigator.limits(),
        ).moving(setpoint.velocity_m_s or ZERO, setpoint.acceleration_m_s2 or ZERO)
        return guidance if setpoint.position_m is None else guidance.at(setpoint.position_m)

    def update(self) -> None:
        """Start a waiting take-off, end a finished one, let old setpoints run out."""
        if self._paused:
            return
        copter = self.vehicle
        if self._takeoff_pending and copter.armed:
            if copter.now_s - copter.arming.armed_at_s >= ARMING_DELAY_S:
                self._takeoff_pending = False
                self.guide(self._takeoff_guidance())
        elif self.submode is Submode.TAKEOFF:
            motion = copter.motion
            near = motion.down_m <= self._takeoff_down_m + TAKEOFF_MARGIN_M
            if near and abs(motion.velocity_down_m_s) < TAKEOFF_SPEED_M_S:
                self.submode = Submode.POSITION
                self._took_off = True
                position = (*self._takeoff_at, self._takeoff_down_m)
                self.target = Setpoint(SetpointFrame.LOCAL, position_m=position)
        if copter.now_s >= self._expires_s:
            self._expire()

    def _expire(self) -> None:
        self._expires_s = math.inf
        turning = self.target.yaw_rate_rad_s is not None
        position = None
        if self.submode is Submode.POSITION_VELOCITY:
            position = self.vehicle.body.moving_target()
        if self.submode is Submode.ACCELERATION:
            self.submode = Submode.VELOCITY
        self.target = replace(
            self.target,
            position_m=position,
            velocity_m_s=ZERO,
            acceleration_m_s2=None,
            yaw_rad=None if turning else self.target.yaw_rad,
            yaw_rate_rad_s=0.0 if turning else None,
        )
        self.guide(self._guidance(self.target))

    def _takeoff_guidance(self) -> Guidance:
        return self.hold_guidance().at((*self._takeoff_at, self._takeoff_down_m))

    def ground_motors(self) -> Motors:
        """A take-off turns the motors up on the ground."""
        lifting = self.submode is Submode.TAKEOFF and not self._takeoff_pending
        return Motors.FLY if lifting else Motors.IDLE
