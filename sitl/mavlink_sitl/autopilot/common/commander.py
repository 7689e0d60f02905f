"""Modes, missions and commands: what people want of any firmware, and whether it may be."""

from __future__ import annotations

import math
from abc import abstractmethod

from mavlink_sitl.autopilot.common.auto import ALLOW_ARMING, Auto
from mavlink_sitl.autopilot.common.aux_switches import AuxSwitches
from mavlink_sitl.autopilot.common.firmware import Firmware, PowerUp
from mavlink_sitl.autopilot.common.mode_switch import ModeSwitch
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem
from mavlink_sitl.autopilot.safety.failsafe import Failsafes
from mavlink_sitl.autopilot.safety.rudder import Rudder
from mavlink_sitl.autopilot.state.mode import Mode
from mavlink_sitl.autopilot.state.setpoint import Setpoint, SetpointFrame
from mavlink_sitl.exchange import LandedState, ModeChanged, Observation, Result, Severity


class Commander(Firmware):
    """A firmware that people command; arguments and attributes as of `Firmware`."""

    def __init__(self, start: PowerUp) -> None:
        super().__init__(start)
        self.failsafe = Failsafes(self)
        steered = "ARMING_RUDDER" in start.parameters
        self.mode_switch = ModeSwitch(self) if steered else None
        self.rudder = Rudder(self) if steered else None
        self.aux_switches = AuxSwitches(self) if steered else None
        self._sticks_seen: tuple[int, int, bool] | None = None
        self._sticks_settle = False

    def first_mode(self) -> int:
        """INITIAL_MODE; soon after the start that of the pilot's switch follows."""
        wanted = int(self.parameters["INITIAL_MODE"])
        return wanted if wanted in self._modes else super().first_mode()

    def switched_mode(self) -> int:
        """The mode of the pilot's mode switch; without one that after the start."""
        position = None if self.mode_switch is None else self.mode_switch.read()
        if self.mode_switch is None or position is None:
            return self.first_mode()
        return self.mode_switch.mode_there(position)

    def begin_underway(self) -> None:
        """See `Firmware`; the switch is where it was before."""
        super().begin_underway()
        if self.mode_switch is not None:
            self.mode_switch.settle()

    def watch(self, observation: Observation) -> None:
        """Check for failures; called once the power monitor has readings."""
        if self.battery_known:
            self.failsafe.update(observation)
        self.fence.update()
        if self.started:
            self._watch_sticks()

    def _watch_sticks(self) -> None:
        """Act on the pilot's switches and held sticks, once one has moved."""
        if self.mode_switch is None or self.rudder is None or self.aux_switches is None:
            return
        stamp = self.radio.stamp(self.now_s)
        if stamp == self._sticks_seen and not self._sticks_settle:
            return
        self._sticks_seen = stamp
        settle = [each.watch() for each in (self.mode_switch, self.rudder, self.aux_switches)]
        self._sticks_settle = any(settle)

    @property
    def aloft(self) -> bool:
        """Whether it is off the ground, as EXTENDED_SYS_STATE has it."""
        return self.armed and not self.landed

    @property
    def landed_state(self) -> LandedState:
        """For EXTENDED_SYS_STATE."""
        if not self.aloft:
            return LandedState.ON_GROUND
        if self.mode.taking_off:
            return LandedState.TAKEOFF
        return LandedState.LANDING if self.mode.landing else LandedState.IN_AIR

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

    def enter_mode(self, number: int) -> bool:
        """Change the mode if it may be entered; says why not."""
        mode = self._modes[number]
        if mode is self.mode:
            return True
        if self.armed:
            reason = None
            if mode.spec.requires_estimate and not self.estimator.position_ok:
                reason = "requires position"
            elif not self.may_begin(mode):
                reason = "init failed"
            if reason is not None:
                text = f"Mode change to {mode.spec.name} failed: {reason}"
                self.say(Severity.WARNING, text)
                return False
        self.change_to(mode)
        return True

    def hold_underway(self) -> None:
        """See `Firmware`: GUIDED."""
        guided = next(m for m in self._modes.values() if m.spec.behaviour == "guided")
        self.change_to(guided)

    def may_begin(self, mode: Mode) -> bool:
        """Whether a mode has what it begins with; says what is missing."""
        if not isinstance(mode, Auto) or not mode.has_mission:
            return not isinstance(mode, Auto)
        if self.landed and not mode.starts_with_takeoff:
            self.say(Severity.CRITICAL, "Auto: Missing Takeoff Cmd")
            return False
        return True

    def change_to(self, mode: Mode) -> None:
        """Let another mode fly."""
        previous = self.mode
        if isinstance(previous, Auto):
            previous.leave()
        controlled = previous.position_controlled
        self.mode = mode
        self.forget_orders()
        mode.enter()
        self.events.append(ModeChanged(mode.spec.name, controlled))
        self._settle()

    def forget_orders(self) -> None:
        """Forget the speeds that were requested until the next change of mode."""
        self.navigator.forget_speeds()

    def mission_changed(self) -> None:
        """An item of the mission was replaced, or its end was cut off."""
        if isinstance(self.mode, Auto):
            self.mode.mission_changed()

    def start_mission(self) -> Result:
        """MISSION_START: AUTO, and no raised throttle needed to take off.

        A mission that is not flown yet is begun twice, by the command and by the mode (read in
        the firmware): its first item is reported twice.
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

    def set_current_item(self, seq: int) -> Result:
        """DO_SET_MISSION_CURRENT and MISSION_SET_CURRENT.

        In AUTO the mission continues there, or ends if no waypoint follows. In other modes the
        next item to fly to is the current one; FAILED without one.
        """
        if not 0 <= seq < len(self.plans.mission.items) or self.auto is None:
            return Result.DENIED
        place = self.auto.next_moving(seq)
        if isinstance(self.mode, Auto):
            self.mode.jump_to(max(seq, int(self.personality.plan_rules.home_first)))
        elif seq and place is not None:
            self.plans.current, self.plans.begins = place, (seq, place)
        elif not seq:
            self.plans.current = 0
        return Result.FAILED if place is None and seq else Result.ACCEPTED

    def clear_mission(self) -> None:
        """Forget the mission; in AUTO it flies the leg to its end."""
        self.plans.mission.replace([])
        self.plans.forget_progress()
        self.saved.mission_length(0)
        self.mission_changed()

    def save_waypoint(self) -> None:
        """Append this place to the mission, where the firmware can."""

    def append_here(self, command: Cmd) -> None:
        """Append an item to the mission, at the vehicle's place and height above home."""
        mission, m = self.plans.mission, self.motion
        if not mission.items:
            mission.put(0, PlanItem(Cmd.WAYPOINT, 0))
        place = self.navigator.frame.to_geodetic(m.north_m, m.east_m, m.down_m)
        x, y = round(place.latitude_deg * 1e7), round(place.longitude_deg * 1e7)
        height_m = self.navigator.height_above_home_m()
        mission.put(len(mission.items), PlanItem(command, x=x, y=y, z=height_m))
        self.saved.mission_length(len(mission.items))

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

    def fly_at_height_of(self, item: PlanItem) -> Result:
        """MISSION_ITEM with current = 3: another height, for planes in GUIDED."""
        return Result.FAILED

    def set_mode(self, number: int) -> Result:
        """DO_SET_MODE and SET_MODE."""
        if number not in self._modes:
            self.say(Severity.WARNING, f"No such mode {number}")
            return Result.FAILED
        return Result.ACCEPTED if self.enter_mode(number) else Result.FAILED

    def force_battery_voltage(self, voltage_v: float) -> None:
        """Where the firmware simulates its battery itself: a voltage for it, or 0."""

    def pause_or_go_on(self, go_on: bool) -> Result:
        """DO_PAUSE_CONTINUE: ArduPilot has it for copters only."""
        return Result.UNSUPPORTED

    def take_off(self, altitude_above_home_m: float) -> Result:
        """NAV_TAKEOFF, for those that lift off vertically."""
        return Result.FAILED

    @abstractmethod
    def setpoint(self, setpoint: Setpoint) -> None:
        """SET_POSITION_TARGET_*: silently ignored in any mode but GUIDED or OFFBOARD."""

    def go_to(self, setpoint: Setpoint) -> None:
        """DO_REPOSITION, once in GUIDED."""
        self.setpoint(setpoint)

    @abstractmethod
    def change_speed(self, kind: int, speed_m_s: float) -> Result:
        """DO_CHANGE_SPEED: 0 and 1 over ground, 2 climbing, 3 sinking."""
