"""The sticks that a pilot holds by MANUAL_CONTROL, and the vehicle that a moved one takes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.autopilot.px4.stick_speeds import SpeedRule, StickSpeeds
from mavlink_sitl.exchange import Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle

_OF_AUTO, _OF_OFFBOARD = 1, 2
"""COM_RC_OVERRIDE"""
_BEFORE_1_18 = SpeedRule(smoothing_s=0.1)
"""As recorded"""
_FROM_1_18 = SpeedRule(smoothing_s=0.05, steady_samples=3)
"""As read in the firmware"""


@dataclass(frozen=True)
class ManualControl:
    """The sticks, -1..1; throttle 0..1.

    Attributes:
        pitch: forward.
        roll: right.
        yaw: clockwise.
        throttle: 0.5 holds height where height is held.
    """

    pitch: float
    roll: float
    yaw: float
    throttle: float

    @property
    def places(self) -> tuple[float, ...]:
        """Of all sticks, -1..1; a throttle goes from -1 to 1 there."""
        return self.pitch, self.roll, self.yaw, 2.0 * self.throttle - 1.0


class Sticks:
    """The sticks of one vehicle.

    One that is moved quickly takes a copter from the modes that COM_RC_OVERRIDE names, to POSCTL;
    the speed counts, not the place, as recorded: a stick that was held away from its centre before
    takes nothing. From 1.18 on (MAN_OVERRIDE_SPD) it takes it from every mode.
    """

    def __init__(self, vehicle: Px4Vehicle, parameters: Parameters) -> None:
        """Begin without a pilot."""
        self._vehicle, self._parameters = vehicle, parameters
        self._newest: ManualControl | None = None
        self._heard_s = -math.inf
        by_speed = parameters.acts("MAN_OVERRIDE_SPD")
        self._rule = _FROM_1_18 if by_speed else _BEFORE_1_18
        self._speeds = StickSpeeds(self._rule)

    def held(self) -> ManualControl | None:
        """Return the sticks that somebody holds, or None."""
        away_s = self._vehicle.now_s - self._heard_s
        return self._newest if away_s < self._parameters["COM_RC_LOSS_T"] else None

    def hear(self, sticks: ManualControl) -> None:
        """Take where they are now."""
        vehicle, now_s = self._vehicle, self._vehicle.now_s
        if self.held() is None:
            self._speeds = StickSpeeds(self._rule)
        passed_s, self._heard_s = now_s - self._heard_s, now_s
        self._newest = sticks
        self._speeds.take(sticks.places, passed_s)
        if not vehicle.armed and not vehicle.was_intended:
            vehicle.intend(px4.POSCTL)  # nobody has chosen a mode since power-up
        elif vehicle.armed and vehicle.obeys_moved_sticks and self._takes():
            vehicle.say(Severity.INFO, "Pilot took over using sticks")
            vehicle.intend(px4.POSCTL if vehicle.can_run(px4.POSCTL) else px4.ALTCTL)

    def _takes(self) -> bool:
        parameters, number = self._parameters, self._vehicle.mode.spec.number
        if self._rule is _FROM_1_18:
            threshold_1_s = parameters["MAN_OVERRIDE_SPD"]
            may_take = threshold_1_s >= 0.0 and number not in px4.BY_STICKS
        else:
            threshold_1_s = 0.01 * parameters["COM_RC_STICK_OV"]
            may_take = self._is_named(int(parameters["COM_RC_OVERRIDE"]))
        return may_take and self._speeds.exceed(threshold_1_s)

    def _is_named(self, bits: int) -> bool:
        spec = self._vehicle.mode.spec
        if spec.number == px4.OFFBOARD:
            return bool(bits & _OF_OFFBOARD)
        # Where it follows a target, the sticks change the place beside it.
        is_auto = spec.name.startswith("AUTO.") and spec.number != px4.FOLLOW_TARGET
        return is_auto and bool(bits & _OF_AUTO)
