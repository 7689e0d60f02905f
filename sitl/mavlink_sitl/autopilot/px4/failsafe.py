"""What PX4 does when something is lost: the mode that flies instead of the intended one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.failsafe import Failsafes
from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.exchange import Observation, Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.copter import Copter
    from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle

_RC_LOSS = {1: px4.LOITER, 2: px4.RTL, 3: px4.LAND}
"""NAV_RCL_ACT; NAV_DLL_ACT has the same numbers"""
_OFFBOARD_LOSS = {3: px4.RTL, 4: px4.LAND, 5: px4.LOITER}
"""COM_OBL_RC_ACT; 0 to 2 are Position, Altitude and Manual, which need sticks"""
_OFFBOARD_TO_PILOT = {0: px4.POSCTL, 1: px4.ALTCTL, 2: px4.MANUAL}
_DISARM = (6, 7)
"""Terminate and disarm in COM_OBL_RC_ACT; 5 and 6 in NAV_RCL_ACT"""


class Px4Failsafes(Failsafes):
    """Watches one vehicle.

    Args:
        copter: it.

    Attributes:
        acting: the mode a failsafe has chosen, or None.
    """

    def __init__(self, copter: Px4Vehicle) -> None:
        """All well."""
        super().__init__()
        self._copter = copter
        self.acting: int | None = None
        self._battery_acted = 0

    @property
    def active(self) -> bool:
        """Whether HEARTBEAT says CRITICAL."""
        return self.acting is not None

    def forget(self) -> None:
        """Somebody has chosen a mode: it is theirs again."""
        self.acting = None

    def gcs_alive(self) -> bool:
        """Whether a ground station was heard within COM_DL_LOSS_T; true before the first."""
        heard_s = self._gcs_heard_s
        limit_s = self._copter.parameters["COM_DL_LOSS_T"]
        return heard_s is None or self._copter.now_s - heard_s < limit_s

    def update(self, copter: Copter, observation: Observation) -> None:
        """Look at the vehicle; act, or give the mode back."""
        px4copter = self._copter
        self._battery_level()
        if not px4copter.armed:
            self.acting = None
            self._battery_acted = 0
            return
        wanted = self._wanted_action()
        if wanted is None:
            if self.acting is not None:
                self.acting = None
                px4copter.enter_mode(px4copter.intention)
            return
        if self.acting is None:
            px4copter.say(Severity.CRITICAL, "Failsafe activated")
        if self.acting != wanted:
            self.acting = wanted
            px4copter.enter_mode(wanted)

    def _wanted_action(self) -> int | None:
        copter = self._copter
        p = copter.parameters
        if not copter.estimator.position_ok and copter.mode.spec.requires_position:
            return px4.LAND
        if copter.intention == px4.OFFBOARD and not copter.stream_alive():
            return self._after_offboard(int(p["COM_OBL_RC_ACT"]))
        pilot_modes = (px4.MANUAL, px4.ALTCTL, px4.POSCTL)
        if copter.intention in pilot_modes and not copter.manual_alive():
            return self._known(int(p["NAV_RCL_ACT"]))
        if self.acting == px4.LAND and not copter.estimator.position_ok:
            return px4.LAND
        if not self.gcs_alive() and p["NAV_DLL_ACT"]:
            return self._known(int(p["NAV_DLL_ACT"]))
        return self._battery_action()

    def _after_offboard(self, action: int) -> int | None:
        if action in _DISARM:
            self._copter.disarm(force=True)
            return None
        mode = _OFFBOARD_LOSS.get(action)
        if mode is None:
            pilots = _OFFBOARD_TO_PILOT.get(action, px4.POSCTL)
            if self._copter.can_run(pilots):
                return pilots
            mode = self._known(int(self._copter.parameters["NAV_RCL_ACT"]))
        return mode

    @staticmethod
    def _known(action: int) -> int:
        return _RC_LOSS.get(action, px4.LOITER)

    def _battery_level(self) -> None:
        copter = self._copter
        p, left = copter.parameters, copter.battery.remaining
        thresholds = (p["BAT_LOW_THR"], p["BAT_CRIT_THR"], p["BAT_EMERGEN_THR"])
        level = sum(left < threshold for threshold in thresholds)
        if level > self.battery_level and copter.armed:
            word = ("Low", "Critical", "Emergency")[level - 1]
            severity = Severity.WARNING if level == 1 else Severity.CRITICAL
            copter.say(severity, f"{word} battery level")
        self.battery_level = level

    def _battery_action(self) -> int | None:
        """COM_LOW_BAT_ACT: 0 warns, 2 lands when critical, 3 returns, then lands."""
        action = int(self._copter.parameters["COM_LOW_BAT_ACT"])
        if action not in (2, 3) or self.battery_level < 2:
            return None
        return px4.LAND if action == 2 or self.battery_level == 3 else px4.RTL
