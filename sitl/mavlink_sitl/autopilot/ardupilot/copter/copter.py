"""A copter's firmware: modes, missions and commands."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from mavlink_sitl.autopilot.ardupilot.copter.copter_auto import CopterAuto
from mavlink_sitl.autopilot.ardupilot.copter.copter_modes import (
    Brake,
    Land,
    Mode,
    PilotHeight,
    Stabilize,
    Throw,
)
from mavlink_sitl.autopilot.ardupilot.copter.guided import Guided, Setpoint, SetpointFrame
from mavlink_sitl.autopilot.ardupilot.copter.guided_attitude import AttitudeTarget
from mavlink_sitl.autopilot.ardupilot.copter.rtl import ReturnToLaunch
from mavlink_sitl.autopilot.common.auto import ALLOW_ARMING, Auto
from mavlink_sitl.autopilot.common.firmware import Firmware, PowerUp
from mavlink_sitl.autopilot.common.motor_test import MotorTest
from mavlink_sitl.autopilot.control.circle import Circle
from mavlink_sitl.autopilot.control.yaw_control import YawControl
from mavlink_sitl.autopilot.personality import ModeSpec
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem
from mavlink_sitl.exchange import (
    Guidance,
    LandedState,
    ModeChanged,
    Observation,
    Result,
    Severity,
    YawMode,
)

BEHAVIOURS: dict[str, Callable[[Copter, ModeSpec], Mode]] = {
    "stabilize": Stabilize,
    "alt_hold": PilotHeight,
    "auto": CopterAuto,
    "guided": Guided,
    "loiter": PilotHeight,
    "rtl": ReturnToLaunch,
    "land": Land,
    "brake": Brake,
    "circle": Circle,
    "throw": Throw,
}

ALOFT_M = 2.5
"""Height above home from which the ground no longer disturbs the magnetometers"""


class Copter(Firmware):
    """A copter from power-up to the next; arguments as of `Firmware`.

    Attributes:
        yaw: where somebody wants the nose to point.
        motor_test: turns single motors.
    """

    def __init__(self, start: PowerUp) -> None:
        self.yaw = YawControl()
        self._was_aloft = False
        self.motor_test = MotorTest(self)
        super().__init__(start)

    def make_mode(self, spec: ModeSpec) -> Mode:
        """The mode that goes with an entry of the personality."""
        return BEHAVIOURS[spec.behaviour](self, spec)

    def force_battery_voltage(self, voltage_v: float) -> None:
        """Where the firmware simulates its battery itself: a voltage for it, or 0."""

    def watch(self, observation: Observation) -> None:
        """Look for what is wrong; once the power monitor has readings."""
        if self.battery_known:
            self.failsafe.update(self, observation)
        self.fence.update()

    @property
    def soft_armed(self) -> bool:
        """Armed, or in a motor test."""
        return self.armed or self.motor_test.running

    def update(self, observation: Observation) -> None:
        """Process the latest state and act; called at a fixed rate."""
        self.yaw.update(observation.motion, observation.time_s)
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
        north, east, down = self.moving_target()
        target = replace(self._wanted, north_m=north, east_m=east, down_m=down)
        self.guide(replace(target, restart_xy=False, restart_z=False))

    @property
    def landed_state(self) -> LandedState:
        """For EXTENDED_SYS_STATE."""
        if not self.armed or self.landed:
            return LandedState.ON_GROUND
        if self.mode.taking_off:
            return LandedState.TAKEOFF
        return LandedState.LANDING if self.mode.landing else LandedState.IN_AIR

    @property
    def guided(self) -> Guided:
        """The GUIDED mode, whether it flies or not."""
        return next(mode for mode in self._modes.values() if isinstance(mode, Guided))

    @property
    def auto(self) -> Auto | None:
        """The mode that flies missions, whether it flies or not."""
        return next((mode for mode in self._modes.values() if isinstance(mode, Auto)), None)

    @property
    def has_mission(self) -> bool:
        """Whether there is a mission to fly."""
        return self.auto is not None and self.auto.has_mission

    @property
    def may_arm_in_mode(self) -> bool:
        """Whether motors may be armed in this mode; AUTO_OPTIONS opens AUTO for it."""
        auto = isinstance(self.mode, Auto) and "AUTO_OPTIONS" in self.parameters
        if auto and int(self.parameters["AUTO_OPTIONS"]) & ALLOW_ARMING:
            return True
        return self.mode.spec.armable

    def _may_start_mission(self, auto: Auto) -> bool:
        if not auto.has_mission:
            return False
        if self.landed and not auto.starts_with_takeoff:
            self.say(Severity.CRITICAL, "Auto: Missing Takeoff Cmd")
            return False
        return True

    def enter_mode(self, number: int) -> bool:
        """Change the mode if it may be entered; says why not."""
        mode = self._modes[number]
        if mode is self.mode:
            return True
        if self.armed:
            reason = None
            if mode.spec.requires_position and not self.estimator.position_ok:
                reason = "requires position"
            elif isinstance(mode, Throw) or (
                isinstance(mode, Auto) and not self._may_start_mission(mode)
            ):
                reason = "init failed"
            if reason is not None:
                text = f"Mode change to {mode.spec.name} failed: {reason}"
                self.say(Severity.WARNING, text)
                return False
        previous = self.mode
        if isinstance(previous, Auto):
            previous.leave()
        self.mode = mode
        self.navigator.forget_speeds()
        self.yaw.forget()
        mode.enter()
        self.events.append(ModeChanged(mode.spec.name, previous.spec.position_controlled))
        self._settle()
        return True

    def mission_changed(self) -> None:
        """An item of the mission was replaced, or its end was cut off."""
        if isinstance(self.mode, Auto):
            self.mode.mission_changed()

    def start_mission(self) -> Result:
        """MISSION_START: AUTO, and no raised throttle needed to take off.

        A mission that is not flown yet is begun twice, by the command and by the mode (read in
        the firmware): its first item is told twice.
        """
        auto = self.auto
        begins = auto is not None and auto is not self.mode
        if auto is None or not auto.has_mission or not self.enter_mode(auto.spec.number):
            if auto is not None and not auto.has_mission:
                self.say(Severity.WARNING, f"Mode change to {auto.spec.name} failed: init failed")
            return Result.FAILED
        if begins:
            auto.enter()
        auto.may_take_off = True
        return Result.ACCEPTED

    def start_landing_sequence(self) -> Result:
        """DO_LAND_START: AUTO, from the mission's item of that name on."""
        items = self.plans.mission.items
        place = next((i for i, item in enumerate(items) if item.command == Cmd.LAND_START), None)
        text = "Mode change to AUTO RTL failed"
        if place is None or self.auto is None:
            self.say(Severity.WARNING, f"{text}: No landing sequence found")
            return Result.FAILED
        if not self.enter_mode(self.auto.spec.number):
            self.say(Severity.WARNING, text)
            return Result.FAILED
        return self.set_current_item(place)

    def set_current_item(self, seq: int) -> Result:
        """DO_SET_MISSION_CURRENT and MISSION_SET_CURRENT."""
        if not 0 <= seq < len(self.plans.mission.items):
            return Result.DENIED
        self.plans.current = seq
        if isinstance(self.mode, Auto):
            self.mode.jump_to(max(seq, int(self.personality.plan_rules.home_first)))
        return Result.ACCEPTED

    def fly_to_item(self, item: PlanItem) -> Result:
        """A mission item that is a target for GUIDED: MISSION_ITEM with current = 2."""
        guided = self.mode.spec.behaviour == "guided"
        if not guided or self.auto is None or not self.armed:
            return Result.FAILED
        target = self.auto.place_of(item, self.motion[:3])
        if not all(math.isfinite(value) for value in target):
            return Result.FAILED
        self.go_to(Setpoint(SetpointFrame.LOCAL, position_m=target))
        return Result.ACCEPTED

    def pause_or_go_on(self, go_on: bool) -> Result:
        """DO_PAUSE_CONTINUE: AUTO and GUIDED stop and hold, or go on."""
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

    def set_mode(self, number: int) -> Result:
        """DO_SET_MODE and SET_MODE."""
        if number not in self._modes:
            self.say(Severity.WARNING, f"No such mode {number}")
            return Result.FAILED
        return Result.ACCEPTED if self.enter_mode(number) else Result.FAILED

    def take_off(self, altitude_above_home_m: float) -> Result:
        """NAV_TAKEOFF: in GUIDED, armed, on the ground, upwards."""
        mode = self.mode
        if not isinstance(mode, Guided) or not self.armed or not self.landed:
            return Result.FAILED
        if not max(self.navigator.height_above_home_m(), 0.0) < altitude_above_home_m:
            return Result.FAILED
        mode.take_off(self.navigator.home_ned_m()[2] - altitude_above_home_m)
        return Result.ACCEPTED

    def setpoint(self, setpoint: Setpoint) -> None:
        """SET_POSITION_TARGET_*: silently ignored in any mode but GUIDED."""
        if isinstance(self.mode, Guided) and not self.fence.blocks(setpoint):
            self.yaw.forget()
            self.mode.setpoint(setpoint)

    def attitude(self, target: AttitudeTarget) -> None:
        """SET_ATTITUDE_TARGET: the same."""
        if isinstance(self.mode, Guided):
            self.yaw.forget()
            self.mode.attitude(target)

    def go_to(self, setpoint: Setpoint) -> None:
        """DO_REPOSITION, once in GUIDED."""
        self.setpoint(setpoint)

    def change_speed(self, kind: int, speed_m_s: float) -> Result:
        """DO_CHANGE_SPEED: 0 and 1 over ground, 2 climbing, 3 sinking; GUIDED only."""
        if not isinstance(self.mode, (Auto, Guided)):
            return Result.FAILED
        if not self.navigator.change_speed(kind, speed_m_s):
            return Result.FAILED
        if isinstance(self.mode, Auto):
            self.mode.limits_changed()
            return Result.ACCEPTED
        self._wanted = replace(self._wanted, limits=self.navigator.limits())
        self.guide_on()
        return Result.ACCEPTED
