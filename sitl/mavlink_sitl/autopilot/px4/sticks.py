"""The sticks that a pilot holds by MANUAL_CONTROL, and the vehicle that a moved one takes."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.exchange import Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle

_FILTER_S = 0.1
"""Time constant of a stick's speed"""
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


class Sticks:
    """The sticks of one vehicle.

    One that is moved quickly takes a copter from the modes that COM_RC_OVERRIDE names, to POSCTL;
    the speed counts, not the place, as recorded: a stick that was held away from its centre before
    takes nothing.
    """

    def __init__(self, vehicle: Px4Vehicle) -> None:
        """Nobody holds them."""
        self._vehicle = vehicle
        self._newest: ManualControl | None = None
        self._heard_s = -math.inf
        self._speeds_1_s = (0.0,) * 4

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
            # A throttle goes from -1 to 1 there.
            scales = (1.0, 1.0, 1.0, 2.0)
            self._speeds_1_s = tuple(
                speed + share * (scale * (new - old) / passed_s - speed)
                for speed, scale, new, old in zip(
                    self._speeds_1_s, scales, astuple(sticks), astuple(before), strict=True
                )
            )
        if not vehicle.armed and not vehicle.was_intended:
            vehicle.intend(px4.POSCTL)  # nobody has chosen a mode since power-up
        elif vehicle.armed and vehicle.obeys_moved_sticks and self._moves() and self._may_take():
            vehicle.say(Severity.INFO, "Pilot took over using sticks")
            vehicle.intend(px4.POSCTL if vehicle.can_run(px4.POSCTL) else px4.ALTCTL)

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
