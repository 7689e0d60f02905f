"""The sticks that a pilot holds by MANUAL_CONTROL, and the vehicle that a moved one takes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.autopilot.px4.stick_override import StickOverride
from mavlink_sitl.exchange import Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle

_FILTER_S = 0.1
"""Time constant of a stick's speed"""
_BY_STICKS = (px4.MANUAL, px4.ALTCTL, px4.POSCTL)
_OF_AUTO, _OF_OFFBOARD = 1, 2
"""COM_RC_OVERRIDE"""


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
    takes nothing. From 1.18 on it takes it from every mode, and `StickOverride` has the rule.
    """

    def __init__(self, vehicle: Px4Vehicle) -> None:
        """Nobody holds them."""
        self._vehicle = vehicle
        self._newest: ManualControl | None = None
        self._heard_s = -math.inf
        self._speeds_1_s: tuple[float, ...] = (0.0,) * 4
        self._override = StickOverride()

    def held(self) -> ManualControl | None:
        """Return the sticks that somebody holds, or None."""
        away_s = self._vehicle.now_s - self._heard_s
        return self._newest if away_s < self._vehicle.parameters["COM_RC_LOSS_T"] else None

    def hear(self, sticks: ManualControl) -> None:
        """Take where they are now."""
        vehicle, before, now_s = self._vehicle, self.held(), self._vehicle.now_s
        passed_s, self._heard_s = now_s - self._heard_s, now_s
        self._newest = sticks
        if before is None:
            self._speeds_1_s = (0.0,) * 4
        elif passed_s > 0.0:
            share = passed_s / (passed_s + _FILTER_S)
            self._speeds_1_s = tuple(
                speed + share * ((new - old) / passed_s - speed)
                for speed, new, old in zip(
                    self._speeds_1_s, sticks.places, before.places, strict=True
                )
            )
        takes = self._takes(sticks)
        if not vehicle.armed and not vehicle.was_intended:
            vehicle.intend(px4.POSCTL)  # nobody has chosen a mode since power-up
        elif vehicle.armed and vehicle.obeys_moved_sticks and takes:
            vehicle.say(Severity.INFO, "Pilot took over using sticks")
            vehicle.intend(px4.POSCTL if vehicle.can_run(px4.POSCTL) else px4.ALTCTL)

    def _takes(self, sticks: ManualControl) -> bool:
        parameters, spec = self._vehicle.parameters, self._vehicle.mode.spec
        if not parameters.acts("MAN_OVERRIDE_SPD"):
            return self._moves() and self._may_take()
        threshold, lost_s = parameters["MAN_OVERRIDE_SPD"], parameters["COM_RC_LOSS_T"]
        moved = self._override.moved(sticks.places, self._vehicle.now_s, threshold, lost_s)
        return moved and spec.number not in _BY_STICKS

    def _moves(self) -> bool:
        threshold_1_s = 0.01 * self._vehicle.parameters["COM_RC_STICK_OV"]
        return any(abs(speed) > threshold_1_s for speed in self._speeds_1_s)

    def _may_take(self) -> bool:
        spec, bits = self._vehicle.mode.spec, int(self._vehicle.parameters["COM_RC_OVERRIDE"])
        if spec.number == px4.OFFBOARD:
            return bool(bits & _OF_OFFBOARD)
        # Where it follows a target, the sticks change the place beside it.
        is_auto = spec.name.startswith("AUTO.") and spec.number != px4.FOLLOW_TARGET
        return is_auto and bool(bits & _OF_AUTO)
