"""ArduCopter: the firmware of one copter."""

from __future__ import annotations

from dataclasses import replace

from mavlink_sitl.autopilot.ardupilot.copter.copter_auto import CopterAuto
from mavlink_sitl.autopilot.ardupilot.copter.copter_modes import Brake, Land, Throw
from mavlink_sitl.autopilot.ardupilot.copter.guided import Guided
from mavlink_sitl.autopilot.ardupilot.copter.landing_target import LandingTarget
from mavlink_sitl.autopilot.ardupilot.copter.pilot_modes import (
    AltHold,
    PilotHeight,
    Stabilize,
)
from mavlink_sitl.autopilot.ardupilot.copter.rtl import ReturnToLaunch
from mavlink_sitl.autopilot.ardupilot.copter.smart_rtl import SmartReturn
from mavlink_sitl.autopilot.common.auto import Auto
from mavlink_sitl.autopilot.common.commander import Commander, PowerUp
from mavlink_sitl.autopilot.common.firmware import Firmware
from mavlink_sitl.autopilot.control.circle import Circle
from mavlink_sitl.autopilot.control.yaw_control import YawControl
from mavlink_sitl.autopilot.plans.plans import Cmd, MissionState
from mavlink_sitl.autopilot.safety.motor_test import MotorTest
from mavlink_sitl.autopilot.state.breadcrumbs import Trail
from mavlink_sitl.autopilot.state.mode import Mode
from mavlink_sitl.autopilot.state.setpoint import Setpoint
from mavlink_sitl.exchange import (
    Guidance,
    ModeChanged,
    Observation,
    Result,
    Severity,
    YawMode,
)

AUTO = 3
"""A mode"""
AT_HOME_M = 0.5
"""Within this of home, it stands on it: the height wanders by as much"""
ALOFT_M = 2.5
"""Height above home from which the ground no longer disturbs the magnetometers"""


class AutoReturn(Mode):
    """AUTO RTL: only a name of AUTO, once that is on its way to the mission's landing."""


class Copter(Commander):
    """A copter from power-up to the next; arguments as of `Commander`.

    Attributes:
        yaw: where somebody wants the nose to point.
        landing_target: where LAND lands, if somebody sees a target.
        motor_test: turns single motors.
        trail: the way since it was armed, for SMART_RTL.
    """

    table = Firmware(
        modes={
            "stabilize": Stabilize,
            "alt_hold": AltHold,
            "auto": CopterAuto,
            "guided": Guided,
            "loiter": PilotHeight,
            "rtl": ReturnToLaunch,
            "land": Land,
            "brake": Brake,
            "circle": Circle,
            "throw": Throw,
            "smart_rtl": SmartReturn,
            "auto_rtl": AutoReturn,
        }
    )

    def __init__(self, start: PowerUp) -> None:
        self.yaw = YawControl()
        self._was_aloft = False
        self.motor_test = MotorTest(self)
        self.landing_target = LandingTarget(self)
        super().__init__(start)
        self.trail = Trail(self, coordinates=3)

    @property
    def soft_armed(self) -> bool:
        """Armed, or in a motor test."""
        return self.armed or self.motor_test.running

    def update(self, observation: Observation) -> None:
        """Process the latest state and act; called at a fixed rate."""
        self.yaw.update(observation.motion, observation.time_s)
        self.landing_target.update()
        revision = self.revision
        super().update(observation)
        self.motor_test.update()
        self._say_aloft()
        if self.yaw.heading_rad is not None and self.revision == revision:
            self.guide_on()

    def _say_aloft(self) -> None:
        if not self._was_aloft and not self.landed:
            self._was_aloft = self.navigator.height_above_home_m() > ALOFT_M
            for text in self.personality.aloft_texts if self._was_aloft else ():
                self.say(Severity.INFO, text)

    def guide(self, guidance: Guidance) -> None:
        """Called by modes; the heading is another one if somebody asked for it."""
        if self.yaw.heading_rad is not None:
            guidance = replace(guidance, yaw_mode=YawMode.ANGLE, yaw_rad=self.yaw.heading_rad)
        super().guide(guidance)

    def guide_on(self) -> None:
        """Continue with the current guidance, with the present heading."""
        north, east, down = self.body.moving_target()
        target = replace(self.wanted, north_m=north, east_m=east, down_m=down)
        self.guide(replace(target, restart_xy=False, restart_z=False))

    @property
    def guided(self) -> Guided:
        """The GUIDED mode, whether it flies or not."""
        return self.mode_of(Guided)

    def watch(self, observation: Observation) -> None:
        """See `Commander`; remembers the way it has come."""
        super().watch(observation)
        self.trail.watch(not isinstance(self.mode, SmartReturn))

    def enter_mode(self, number: int) -> bool:
        """See `Commander`; AUTO RTL is AUTO from the landing sequence on."""
        mode = self._modes[number]
        if isinstance(mode, AutoReturn):
            return self.start_landing_sequence() is Result.ACCEPTED
        if isinstance(mode, SmartReturn) and mode is not self.mode and not self.trail.known:
            text = f"Mode change to {mode.spec.name} failed: init failed"
            self.say(Severity.WARNING, text)
            return False
        auto = self.auto
        if mode is auto and mode is self.mode and mode.spec.number != number:
            mode.spec = self.personality.modes[number]
            self.events.append(ModeChanged(mode.spec.name, True))
            return True
        return super().enter_mode(number)

    def may_begin(self, mode: Mode) -> bool:
        """See `Commander`; nobody throws it here."""
        return super().may_begin(mode) and not isinstance(mode, Throw)

    def forget_orders(self) -> None:
        """See `Commander`; where the nose was to point, too."""
        super().forget_orders()
        self.yaw.forget()

    def start_mission(self) -> Result:
        """See `Commander`; in AUTO a mission that is over begins again, as AUTO, not its return."""
        auto = self.auto
        auto.spec = self.personality.modes[AUTO]
        over = self.plans.state not in (MissionState.ACTIVE, MissionState.PAUSED)
        if self.mode is auto and over and auto.has_mission:
            auto.enter()
        return super().start_mission()

    def start_landing_sequence(self) -> Result:
        """DO_LAND_START: AUTO, from the mission's item of that name on."""
        items = self.plans.mission.items
        place = next((i for i, item in enumerate(items) if item.command == Cmd.LAND_START), None)
        text = "Mode change to AUTO RTL failed"
        if place is None:
            self.say(Severity.WARNING, f"{text}: No landing sequence found")
            return Result.FAILED
        named = next(
            (m.spec for m in self._modes.values() if m.spec.behaviour == "auto_rtl"), self.auto.spec
        )
        if self.mode is not self.auto and not self.enter_mode(AUTO):
            self.say(Severity.WARNING, text)
            return Result.FAILED
        self.auto.spec = named
        self.events.append(ModeChanged(named.name, named.position_controlled))
        return self.auto.set_current(place)

    def change_to(self, mode: Mode) -> None:
        """See `Commander`; AUTO begins under its own name."""
        if mode is self.auto:
            mode.spec = self.personality.modes[AUTO]
        super().change_to(mode)

    def save_waypoint(self) -> None:
        """See `Commander`: first a take-off, then waypoints, with a closed throttle a landing."""
        auto, closed = self.auto, self.radio.throttle(self.now_s) == 0.0
        if self.mode is auto or not self.armed or (closed and not auto.has_mission):
            return
        if not auto.has_mission:
            auto.append_here(Cmd.TAKEOFF)
        auto.append_here(Cmd.LAND if closed else Cmd.WAYPOINT)

    def pause_or_go_on(self, go_on: bool) -> Result:
        """DO_PAUSE_CONTINUE: AUTO and GUIDED stop and hold, or continue."""
        if isinstance(self.mode, Auto):
            return self.mode.go_on() if go_on else self.mode.pause()
        if not isinstance(self.mode, Guided):
            return Result.FAILED
        if go_on:
            self.mode.go_on()
        else:
            self.mode.pause()
        return Result.ACCEPTED

    def land_after_pause(self) -> None:
        """In LAND: stay for a while before sinking."""
        if isinstance(self.mode, Land):
            self.mode.pause()

    def take_off(self, altitude_above_home_m: float) -> Result:
        """NAV_TAKEOFF: in GUIDED, armed, on the ground, upwards."""
        mode = self.mode
        if not isinstance(mode, Guided) or not self.armed or not self.landed:
            return Result.FAILED
        # takeoff.cpp, do_user_takeoff: not downwards; far below home that is a negative altitude.
        standing_m = self.navigator.height_above_home_m()
        if standing_m > -AT_HOME_M:
            standing_m = max(standing_m, 0.0)
        if not standing_m < altitude_above_home_m:
            return Result.FAILED
        mode.take_off(self.navigator.home_ned_m()[2] - altitude_above_home_m)
        return Result.ACCEPTED

    def setpoint(self, setpoint: Setpoint) -> None:
        """SET_POSITION_TARGET_*: silently ignored in any mode but GUIDED."""
        if isinstance(self.mode, Guided) and not self.fence.blocks(setpoint):
            self.yaw.forget()
            self.mode.setpoint(setpoint)

    def change_speed(self, kind: int, speed_m_s: float) -> Result:
        """DO_CHANGE_SPEED: 0 and 1 over ground, 2 climbing, 3 sinking; GUIDED only."""
        if not isinstance(self.mode, (Auto, Guided)):
            return Result.FAILED
        if not self.navigator.change_speed(kind, speed_m_s):
            return Result.FAILED
        if isinstance(self.mode, Auto):
            self.mode.limits_changed()
            return Result.ACCEPTED
        self.wanted = replace(self.wanted, limits=self.navigator.limits())
        self.guide_on()
        return Result.ACCEPTED
