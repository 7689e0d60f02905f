"""PX4's commander for all vehicle types: intentions, failsafes, arming.

The mode that people choose is the *intention*. Another mode may fly while a failsafe acts, and
the intention comes back into force by itself when its reason is gone (a restarted
setpoint stream takes control again). Texts and results are those of the recordings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from mavlink_sitl.autopilot.common.auto import Auto
from mavlink_sitl.autopilot.common.commander import Commander, PowerUp
from mavlink_sitl.autopilot.common.firmware import Firmware
from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.autopilot.plans.plans import PlanItem
from mavlink_sitl.autopilot.px4.arming import Px4Arming
from mavlink_sitl.autopilot.px4.battery import Px4Battery
from mavlink_sitl.autopilot.px4.calibration import Calibration
from mavlink_sitl.autopilot.px4.failsafe import Px4Failsafes
from mavlink_sitl.autopilot.px4.feasibility import Feasibility
from mavlink_sitl.autopilot.px4.geofence import Px4Geofence
from mavlink_sitl.autopilot.px4.mission_mode import Px4Mission
from mavlink_sitl.autopilot.px4.mode import HoldMode, OffboardMode, Px4Mode, TakeoffMode
from mavlink_sitl.autopilot.px4.navigation import Px4Navigator
from mavlink_sitl.autopilot.px4.payload import Px4Payload
from mavlink_sitl.autopilot.px4.safety_systems import SafetySystems
from mavlink_sitl.autopilot.px4.sticks import Sticks
from mavlink_sitl.autopilot.state.setpoint import Setpoint
from mavlink_sitl.exchange import (
    Observation,
    Result,
    Severity,
    StatusText,
    SystemStatus,
    Vector,
)
from mavlink_sitl.geodesy import GeoPoint

HOME_DRIFT_S = 120.0
HOME_DRIFT_M = 1.2
"""The recorded home went from 487.4 m to 489.8 m in one flight"""
REFUSAL_TEXT_S = 1.0
"""The text about a rejected mode comes at most once in this time"""
NEEDS_STICKS = ("px4_manual", "px4_altitude", "px4_position")
"""Behaviours of modes that somebody has to hold the sticks for"""
_NOT_RESTORED = (px4.LAND, px4.ORBIT, px4.PRECLAND, px4.RTL, px4.TAKEOFF)
"""Intentions that do not outlive the flight: it cannot be armed in them, or takes off"""


def px4_table(**parts: Any) -> Firmware:
    """Return PX4 with the parts of a kind of vehicle; in AUTO.LOITER without a receiver."""
    return Firmware(
        arming=Px4Arming,
        failsafes=Px4Failsafes,
        fence=Px4Geofence,
        first_mode=px4.LOITER,
        keeps_early_mode=True,
        **parts,
    )


class Px4Vehicle(Commander):
    """A vehicle with PX4, from power-up to the next; one class a kind derives from it.

    Attributes:
        intention: the mode that people want (CURRENT_MODE.intended_custom_mode).
        battery: the simulated pack, which follows SIM_BAT_* and not the motors.
        calibration: of its sensors.
        was_intended: whether somebody has chosen a mode since power-up.
        sticks: of its pilot.
        systems: that it looks after in flight.
        setpoint_at_s: when the latest usable offboard setpoint came.
        in_flight: from "Takeoff detected" to "Landing detected".
        took_off_at_s: when the former was said last.
        after_disarming: the latest intention that may be armed in, which is wanted again then.
    """

    navigator: Px4Navigator
    arming: Px4Arming
    failsafe: Px4Failsafes
    fence: Px4Geofence
    mode: Px4Mode
    payload: Px4Payload
    obeys_moved_sticks = False
    """Whether a moved stick takes it from modes that fly by themselves."""

    def __init__(self, start: PowerUp) -> None:
        self.intention = px4.LOITER
        self.setpoint_at_s = -math.inf
        self.was_intended = False
        self.sticks = Sticks(self, start.parameters)
        self.systems = SafetySystems(self)
        self.in_flight = False
        self.took_off_at_s = -math.inf
        self.battery = Px4Battery(start.parameters)
        self.feasibility = Feasibility(self)
        self.calibration = Calibration(self)
        self.after_disarming = px4.LOITER
        self._refused_at_s = -math.inf
        super().__init__(start)
        self.payload = Px4Payload(self, start.photo_camera)

    # State.

    @property
    def system_status(self) -> SystemStatus:
        """UNINIT when the chosen mode cannot run, CRITICAL in a failsafe, CALIBRATING."""
        if self.armed:
            return SystemStatus.CRITICAL if self.failsafe.active else SystemStatus.ACTIVE
        if self.calibration.busy:
            return SystemStatus.CALIBRATING
        return SystemStatus.STANDBY if self.can_arm() else SystemStatus.UNINIT

    @property
    def aloft(self) -> bool:
        """From 'Takeoff detected' on."""
        return self.armed and self.in_flight

    def height_above_ground_m(self) -> float:
        """Height above where it stood when home was set; the ground is taken to be flat."""
        return self.navigator.true_home_down_m() - self.motion.down_m

    @property
    def base_flags(self) -> int:
        """HEARTBEAT.base_mode of the mode in force.

        OFFBOARD controls what the latest setpoint asks for: before the first one, nothing (1
        was observed on PX4 v1.17, and 17 ever after).
        """
        spec = self.mode.spec
        unasked = spec.number == px4.OFFBOARD and self.setpoint_at_s == -math.inf
        return 0 if unasked else spec.base_flags

    def stream_alive(self) -> bool:
        """Whether usable setpoints come often enough for OFFBOARD (COM_OF_LOSS_T)."""
        return self.now_s - self.setpoint_at_s < self.parameters["COM_OF_LOSS_T"]

    def can_run(self, number: int) -> bool:
        """Whether a mode has what it needs."""
        spec = self.personality.modes[number]
        if spec.requires_position and not self.estimator.position_ok:
            return False
        if number == px4.OFFBOARD:
            return self.stream_alive()
        if number == px4.MISSION:
            return self.auto.has_mission
        if spec.behaviour in NEEDS_STICKS:
            return self.sticks.held() is not None
        return True

    def can_arm(self) -> bool:
        """Whether the health and arming checks pass in the chosen mode."""
        return (
            self.body.damage is None
            and not self.calibration.busy
            and self.mode.spec.armable
            and self.estimator.position_ok
            and not self.fence.breached
            and not self.systems.missing()
            and self.can_run(self.mode.spec.number)
        )

    # Periodic updates.

    def update(self, observation: Observation) -> None:
        """Process the latest state and act; called at a fixed rate."""
        self.battery.update(observation.time_s, self.armed)
        super().update(observation)
        self.systems.update()
        self.feasibility.holds()
        self.calibration.update()
        self._detect_flight()
        self._drift_home()

    def takes_off(self) -> bool:
        """Whether the land detector says, armed and not yet in flight, that it flies now."""
        return not self.landed

    def has_landed(self) -> bool:
        """Whether the land detector says, in flight, that it is over."""
        return self.landed

    def may_land_by(self, items: Sequence[PlanItem]) -> bool:
        """Whether this kind can land as a mission says."""
        return True

    def may_disarm(self) -> bool:
        """Whether it may be disarmed without force."""
        return not self.in_flight

    def _detect_flight(self) -> None:
        """The firmware's idea of being in the air, with its two texts."""
        if not self.armed:
            self.in_flight = False
        elif not self.in_flight and self.takes_off():
            self.in_flight = True
            self.took_off_at_s = self.now_s
            self.set_home()
            self.say(Severity.INFO, "Takeoff detected")
        elif self.in_flight and self.has_landed():
            self.in_flight = False
            self.arming.landed()
            self.set_home()
            self.say(Severity.INFO, "Landing detected")

    def _drift_home(self) -> None:
        """Home's altitude is corrected with the GNSS receiver's drift in the first 2 minutes."""
        flown_s = self.now_s - self.took_off_at_s
        if self.in_flight and flown_s < HOME_DRIFT_S:
            self.navigator.drift_home(-HOME_DRIFT_M * math.sin(flown_s * math.tau / 60.0))

    # Requests by people.

    def set_mode(self, number: int, with_text: bool = False) -> Result:
        """A mode for the autopilot: any while disarmed, one that can run while armed.

        Args:
            number: HEARTBEAT.custom_mode.
            with_text: a text reports a rejection, besides the result.
        """
        result = self._change_mode(number)
        if with_text and result is Result.TEMPORARILY_REJECTED:
            self._say_refused(number)
        return result

    def _say_refused(self, number: int) -> None:
        """At most once a second."""
        name = px4.MODE_NAMES.get(number)
        if name is not None and self.now_s > self._refused_at_s + REFUSAL_TEXT_S:
            self._refused_at_s = self.now_s
            self.say(Severity.CRITICAL, f"Switching to {name} is currently not available")

    def _change_mode(self, number: int) -> Result:
        if number not in self.personality.modes:
            if number >> 16 & 0xFF == px4.MAIN_AUTO and number not in px4.MODE_NAMES:
                self.say(Severity.CRITICAL, "Unsupported auto mode")
                return Result.TEMPORARILY_REJECTED
            # A main mode that does not exist is "accepted" and changes nothing.
            known = number in px4.MODE_NAMES and number != px4.TERMINATION
            return Result.TEMPORARILY_REJECTED if known else Result.ACCEPTED
        if self.armed and not self.can_run(number):
            return Result.TEMPORARILY_REJECTED
        if self.armed and number == px4.MISSION and not self.feasibility.known():
            return Result.TEMPORARILY_REJECTED  # of a mission just uploaded
        self.intend(number)
        return Result.ACCEPTED

    def hold_underway(self) -> None:
        """See `Commander`: AUTO.LOITER, and in flight long enough that home no longer drifts."""
        self.in_flight = True
        self.took_off_at_s = self.arming.lift_began_s = self.boot_s - HOME_DRIFT_S
        self.restart_mode(px4.LOITER)

    def intend(self, number: int) -> None:
        """Make a mode the intention; it takes over at once."""
        self.intention, self.was_intended = number, True
        if number not in _NOT_RESTORED:
            self.after_disarming = number
        self.failsafe.forget()
        self.enter_mode(number)

    def enter_mode(self, number: int) -> bool:
        """Let a mode fly, whatever the intention is."""
        mode = self._modes[number]
        if mode is self.mode:
            return True
        self.change_to(mode)
        return True

    def restart_mode(self, number: int) -> None:
        """Enter a mode, from its beginning if it flies already."""
        if self.mode.spec.number == number:
            self.mode.enter()
        self.intend(number)

    def flight_ended(self) -> None:
        """Disarmed: what was wanted before landing, returning or taking off is wanted again."""
        self.in_flight = False
        self.intend(self.after_disarming)

    def take_off_to(self, altitude_amsl_m: float | None) -> Result:
        """NAV_TAKEOFF: always accepted, changes to AUTO.TAKEOFF, armed or not."""
        self.mode_of(TakeoffMode).wanted_amsl_m = altitude_amsl_m
        self.restart_mode(px4.TAKEOFF)
        return Result.ACCEPTED

    def reposition(
        self, point: GeoPoint | None, altitude_amsl_m: float | None, yaw_rad: float | None
    ) -> Result:
        """DO_REPOSITION with CHANGE_MODE: to AUTO.LOITER, and when armed somewhere.

        Without a place and a height it stops. With a height alone it continues to the place of the
        mission's item in force.
        """
        hold, mission = self.mode_of(HoldMode), self.mode
        flown = mission.last_place() if isinstance(mission, Px4Mission) else None
        self.intend(px4.LOITER)
        if not self.armed:
            return Result.ACCEPTED
        if point is None and altitude_amsl_m is None:
            self.restart_mode(px4.LOITER)
            return Result.ACCEPTED
        if point is None and altitude_amsl_m is not None and flown is not None:
            hold.stay_at(flown)
        hold.go_to(point, altitude_amsl_m, yaw_rad)
        return Result.ACCEPTED

    def start_mission(self, first: float = 0.0) -> Result:
        """MISSION_START: AUTO.MISSION, and the motors are armed.

        Args:
            first: an item that has to exist, or -1; it begins at the current one all the same.
        """
        if not (self.auto.has_mission and self.feasibility.known()):
            self.say(Severity.CRITICAL, "Mission start denied! No valid mission")
            return Result.DENIED
        if not -1.0 <= first < len(self.plans.mission.items):
            return Result.DENIED
        result = self.set_mode(px4.MISSION)
        if result is Result.ACCEPTED:
            result = self.arm(by="mission start")
        if result is not Result.ACCEPTED:
            self._say_refused(px4.MISSION)
        return result

    def change_speed(self, kind: int, speed_m_s: float) -> Result:
        """DO_CHANGE_SPEED: for the AUTO modes, until the mode changes; always accepted.

        Without a positive speed it is the usual one again.
        """
        if not self.navigator.change_speed(kind, speed_m_s):
            self.navigator.forget_speeds()
        if isinstance(self.mode, (HoldMode, Auto)):
            self.mode.limits_changed()
        return Result.ACCEPTED

    def hold_at(self, place_ned_m: Vector) -> None:
        """AUTO.LOITER at a place, as after a take-off."""
        self.intend(px4.LOITER)
        self.mode_of(HoldMode).stay_at(place_ned_m)

    def return_to_launch(self) -> Result:
        """NAV_RETURN_TO_LAUNCH; said before the mode says where it goes."""
        before = len(self.events)
        result = self.set_mode(px4.RTL, with_text=True)
        if result is Result.ACCEPTED:
            self.events.insert(before, StatusText(Severity.INFO, "Returning to launch"))
        return result

    def land_here(self) -> Result:
        """NAV_LAND."""
        self.say(Severity.INFO, "Landing at current position")
        self.intend(px4.LAND)
        return Result.ACCEPTED

    def setpoint(self, setpoint: Setpoint) -> None:
        """A usable offboard setpoint: kept whatever the mode; OFFBOARD follows the latest."""
        self.setpoint_at_s = self.now_s
        self.mode_of(OffboardMode).take(setpoint)

    def terminate(self) -> Result:
        """DO_FLIGHTTERMINATION: the motors stop for good."""
        self.disarm(force=True)
        return Result.ACCEPTED
