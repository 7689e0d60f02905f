"""Battery, ground station and estimator failsafes with the firmware's own parameters."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.exchange import Observation, Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander

MODE_ALT_HOLD = 2
MODE_LAND = 9
MODE_RTL = 6
MODE_BRAKE, MODE_SMART_RTL, MODE_AUTO_RTL = 17, 21, 27

RADIO_AFTER_S = 0.5
"""Time without pulses after which the radio is lost; the firmware was seen to act within 1 s"""
THR_LAND = 3
"""FS_THR_ENABLE; the others return"""

EKF_REPORT, EKF_ALT_HOLD, EKF_LAND_ALWAYS = 0, 2, 3
"""FS_EKF_ACTION; 1 lands from modes that need a position"""

TERMINATES = 5
"""BATT_FS_LOW_ACT and BATT_FS_CRT_ACT"""
_BATTERY_ACTIONS = {
    1: (MODE_LAND,),
    2: (MODE_RTL,),
    3: (MODE_SMART_RTL, MODE_RTL),
    4: (MODE_SMART_RTL, MODE_LAND),
    6: (MODE_AUTO_RTL, MODE_RTL),
    7: (MODE_BRAKE, MODE_LAND),
}
"""The same: the modes that are tried; 0 is a warning only."""
_RADIO_ACTIONS = {
    THR_LAND: (MODE_LAND,),
    4: (MODE_SMART_RTL, MODE_RTL),
    5: (MODE_SMART_RTL, MODE_LAND),
    6: (MODE_AUTO_RTL, MODE_RTL),
    7: (MODE_BRAKE, MODE_LAND),
}
"""FS_THR_ENABLE"""


class Failsafes:
    """Watches, and changes the mode when something is wrong.

    Attributes:
        battery_level: 0 fine, 1 low, 2 critical. Never gets better in a flight.
        gcs_lost: the ground station has been silent too long.
        estimator_lost: the EKF failsafe has acted.
    """

    def __init__(self, vehicle: Commander) -> None:
        self._vehicle = vehicle
        self.battery_level = 0
        self.gcs_lost = False
        self.estimator_lost = False
        self._radio_gone_s: float | None = None
        self._below_since_s: dict[int, float] = {}
        self._gcs_heard_s: float | None = None
        self._parameters_revision = -1
        self._well_above_v = math.inf
        self._glitching = False

    @property
    def radio_lost(self) -> bool:
        """Whether the pilot's radio has been silent too long."""
        return self._vehicle.radio.failed

    @radio_lost.setter
    def radio_lost(self, lost: bool) -> None:
        self._vehicle.radio.failed = lost

    @property
    def active(self) -> bool:
        """Whether HEARTBEAT says CRITICAL."""
        return self.battery_level > 0 or self.gcs_lost or self.estimator_lost or self.radio_lost

    def gcs_heartbeat(self, now_s: float) -> None:
        """The ground station is there. Setpoints and commands do not count."""
        self._gcs_heard_s = now_s

    def battery_reasons(self) -> list[str]:
        """The reasons for which the battery prevents arming."""
        if self.battery_level == 0:
            return []
        return ["Battery 1 low voltage failsafe", "Battery failsafe"]

    def update(self, observation: Observation) -> None:
        """Look at one observation and act."""
        self._battery(observation)
        self._ground_station(observation.time_s)
        self._radio(observation.time_s)
        self._estimator()

    def _battery(self, observation: Observation) -> None:
        parameters, battery = self._vehicle.parameters, observation.battery
        if parameters.revision != self._parameters_revision:
            self._parameters_revision = parameters.revision
            highest_v = max(parameters["BATT_LOW_VOLT"], parameters["BATT_CRT_VOLT"])
            self._well_above_v = math.inf if parameters["BATT_LOW_MAH"] else highest_v
        if battery.voltage_v >= self._well_above_v:
            self._below_since_s.clear()
            return
        left_mah = parameters["BATT_CAPACITY"] - battery.consumed_mah
        below = {
            2: 0.0 < battery.voltage_v < parameters["BATT_CRT_VOLT"],
            1: 0.0 < battery.voltage_v < parameters["BATT_LOW_VOLT"]
            or left_mah < parameters["BATT_LOW_MAH"] > 0.0,
        }
        for level, is_below in below.items():
            if not is_below:
                self._below_since_s.pop(level, None)
                continue
            since_s = self._below_since_s.setdefault(level, observation.time_s)
            held = observation.time_s - since_s >= parameters["BATT_LOW_TIMER"]
            if held and level > self.battery_level:
                self._battery_fails(observation, level)
                return

    def _battery_fails(self, observation: Observation, level: int) -> None:
        vehicle = self._vehicle
        self.battery_level = level
        battery = observation.battery
        word = "critical" if level == 2 else "low"
        text = f"Battery 1 is {word} {battery.voltage_v:.2f}V used {battery.consumed_mah:.0f} mAh"
        vehicle.say(Severity.WARNING, text)
        if not vehicle.armed:
            return
        vehicle.say(Severity.WARNING, "Battery Failsafe")
        name = "BATT_FS_CRT_ACT" if level == 2 else "BATT_FS_LOW_ACT"
        self._empty(int(vehicle.parameters[name]))

    def _empty(self, action: int) -> None:
        """Do what BATT_FS_*_ACT says."""
        if action == TERMINATES:
            self._vehicle.disarm(force=True)
        else:
            self._act(*_BATTERY_ACTIONS.get(action, ()))

    def _silent_for_s(self, now_s: float) -> float:
        """How long the ground station has said nothing; 0 before it said anything."""
        return 0.0 if self._gcs_heard_s is None else now_s - self._gcs_heard_s

    def _ground_station(self, now_s: float) -> None:
        vehicle = self._vehicle
        parameters = vehicle.parameters
        if self._gcs_heard_s is None or not parameters["FS_GCS_ENABLE"]:
            self.gcs_lost = False
            return
        lost = self._silent_for_s(now_s) >= parameters["FS_GCS_TIMEOUT"]
        if lost and not self.gcs_lost and vehicle.armed:
            self.gcs_lost = True
            vehicle.say(Severity.WARNING, "GCS Failsafe")
            self._act(MODE_RTL)
        elif self.gcs_lost and not lost:
            self.gcs_lost = False
            vehicle.say(Severity.WARNING, "GCS Failsafe Cleared")

    def _radio(self, now_s: float) -> None:
        """RTL within a second, from GUIDED too; the ground may choose GUIDED again."""
        vehicle = self._vehicle
        p = vehicle.parameters
        action = int(p["FS_THR_ENABLE"]) if "FS_THR_ENABLE" in p else 0
        if not action or vehicle.radio.heard(now_s):
            self._radio_gone_s = None
            if self.radio_lost:
                self.radio_lost = False
                vehicle.say(Severity.WARNING, "Radio Failsafe Cleared")
            return
        if self._radio_gone_s is None:
            self._radio_gone_s = now_s
        if self.radio_lost or now_s - self._radio_gone_s < RADIO_AFTER_S or not vehicle.armed:
            return
        self.radio_lost = True
        vehicle.say(Severity.WARNING, "Radio Failsafe")
        self._act(*_RADIO_ACTIONS.get(action, (MODE_RTL,)))

    def _glitch(self) -> None:
        """ArduCopter's gpsglitch_check: no more than its words."""
        vehicle = self._vehicle
        if vehicle.estimator.glitching is not self._glitching:
            self._glitching = vehicle.estimator.glitching
            words = "GPS Glitch or Compass error" if self._glitching else "Glitch cleared"
            vehicle.say(Severity.CRITICAL, words)

    def _estimator(self) -> None:
        vehicle = self._vehicle
        self._glitch()
        variance = vehicle.estimator.variance
        if variance and not self.estimator_lost and vehicle.armed and not vehicle.landed:
            self.estimator_lost = True
            vehicle.say(Severity.CRITICAL, "EKF variance")
            self._estimator_fails()
        elif self.estimator_lost and not variance:
            self.estimator_lost = False
            vehicle.say(Severity.CRITICAL, "EKF Failsafe Cleared")

    def _estimator_fails(self) -> None:
        """Do what FS_EKF_ACTION says."""
        vehicle = self._vehicle
        action = int(vehicle.parameters["FS_EKF_ACTION"])
        needed = vehicle.mode.spec.requires_position or action == EKF_LAND_ALWAYS
        if action == EKF_REPORT or not needed:
            vehicle.say(Severity.CRITICAL, "EKF Failsafe")
            return
        holds = action == EKF_ALT_HOLD and not self.radio_lost
        if not (holds and vehicle.enter_mode(MODE_ALT_HOLD)):
            self._act(MODE_LAND)
        text = f"EKF Failsafe: changed to {vehicle.mode.spec.name} Mode"
        vehicle.say(Severity.CRITICAL, text)

    def _act(self, *modes: int) -> None:
        """Change to the first mode that can be; on the ground disarm; LAND if there is none."""
        vehicle = self._vehicle
        if not modes:
            return
        if vehicle.landed:
            vehicle.disarm(force=True)
        elif any(mode != MODE_LAND and vehicle.enter_mode(mode) for mode in modes):
            return
        elif vehicle.mode.spec.number != MODE_LAND and vehicle.enter_mode(MODE_LAND):
            vehicle.land_after_pause()
