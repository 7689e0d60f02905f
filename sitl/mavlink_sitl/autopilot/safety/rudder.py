"""Arming and disarming by the pilot: throttle closed, the yaw stick held to a side."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.state.radio import FULL_STICK

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander

HELD_S, HELD_ON_A_PLANE_S = 2.0, 3.0
OFF, ARMS_AND_DISARMS = 0, 2
"""ARMING_RUDDER; 1 only arms"""
DRIVES_ITSELF_M_S = 0.1
STICK = "stick"
"""Arming by the rudder stick"""
BY_ORDER = ("auto", "guided")
"""Behaviours in which only a ground station arms"""


class Rudder:
    """Watches the stick that steers: yaw of aircraft, steering of rovers and boats."""

    def __init__(self, vehicle: Commander) -> None:
        self._vehicle = vehicle
        self._since_s: float | None = None
        self._done = False

    def watch(self) -> bool:
        """Look at the sticks; whether one is held to a side."""
        vehicle = self._vehicle
        allowed = int(vehicle.parameters["ARMING_RUDDER"])
        side = self._side() if allowed != OFF and self._throttle_closed() else 0
        asked = side > 0 if not vehicle.armed else side < 0 and allowed == ARMS_AND_DISARMS
        if side == 0:
            self._done = False
        if not asked or not self._possible():
            self._since_s = None
            return side != 0
        if self._since_s is None:
            self._since_s = vehicle.now_s
        held_s = HELD_ON_A_PLANE_S if self._kind == "plane" else HELD_S
        if self._done or vehicle.now_s - self._since_s < held_s:
            return True
        if vehicle.armed:
            vehicle.disarm()
        else:
            vehicle.arm(by=STICK)
        # Held on, it tries again; but what is armed is not disarmed by the same push.
        self._since_s, self._done = None, vehicle.armed
        return True

    @property
    def _kind(self) -> str:
        return self._vehicle.personality.kind

    @property
    def _drives(self) -> bool:
        return self._kind in ("rover", "boat")

    def _side(self) -> int:
        """1 with the stick to the right, -1 to the left."""
        axis = "Roll" if self._drives else "Yaw"
        angle = self._vehicle.radio.angle(axis, self._vehicle.now_s)
        return (angle > FULL_STICK) - (angle < -FULL_STICK)

    def _throttle_closed(self) -> bool:
        vehicle = self._vehicle
        if self._drives:
            return vehicle.radio.angle("Throttle", vehicle.now_s) == 0.0
        return vehicle.radio.throttle(vehicle.now_s) == 0.0

    def _possible(self) -> bool:
        """Whether it is of use to hold the stick there."""
        vehicle = self._vehicle
        if not vehicle.radio.obeyed(vehicle.now_s):
            return False
        if self._drives:
            by_itself = vehicle.mode.spec.requires_position
            rolls = vehicle.armed and vehicle.motion.speed_m_s > DRIVES_ITSELF_M_S
            return not by_itself and not rolls
        manual = vehicle.mode.spec.behaviour in ("stabilize", "acro")
        return not vehicle.armed or vehicle.landed or (self._kind == "copter" and manual)
