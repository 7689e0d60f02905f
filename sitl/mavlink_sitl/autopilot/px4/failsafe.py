"""PX4's failsafes: the mode that replaces the intended one.

Read in the firmware's failsafe framework: every cause has an action, and the gravest one flies.
Where somebody could still take over, it first holds, the first time for COM_FAIL_ACT_T. What it
holds is taken from that, and a quarter of the time without is given back. A person who chooses
another mode has taken over, until something else fails. OFFBOARD without a stream falls back at
once, as recorded (`offboard_loss_stop`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.autopilot.px4.safety_systems import PARACHUTE, REMOTE_ID
from mavlink_sitl.autopilot.safety.failsafe import Failsafes
from mavlink_sitl.exchange import Observation, Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle

WARN, TERMINATE = -1, -2
"""Actions that are no modes; disarming counts as terminating"""
_LINK_LOSS = {1: px4.LOITER, 2: px4.RTL, 3: px4.LAND, 5: TERMINATE, 6: TERMINATE}
"""NAV_RCL_ACT and NAV_DLL_ACT"""
HOLD_WITHOUT_FAILSAFE = 7
"""NAV_RCL_ACT of 1.18: only who flies by sticks is put into Hold, as by a change of the mode"""
_FENCE = {1: WARN, 2: px4.LOITER, 3: px4.RTL, 4: TERMINATE, 5: px4.LAND}
"""GF_ACTION"""
_PARACHUTE = {1: WARN, 2: px4.RTL, 3: px4.LAND}
"""COM_PARACHUTE from 1.18 on"""
_REMOTE_ID = {3: px4.RTL, 4: px4.LAND, 5: TERMINATE}
"""COM_ARM_ODID"""
_RECEIVERS = {1: px4.RTL, 2: px4.LAND, 3: TERMINATE}
"""COM_GNSSLOSS_ACT; all others warn"""
_NEVER_TERMINATES = 121212
"""CBRK_FLIGHTTERM"""
_REFILL = 0.25
"""Of the time without a delayed action"""
_EARLY_S = 3.0
"""From the end of COM_SPOOLUP_TIME: until then a lost altitude disarms"""
_OFFBOARD_LOSS = {3: px4.RTL, 4: px4.LAND, 5: px4.LOITER, 6: TERMINATE, 7: TERMINATE}
"""COM_OBL_RC_ACT; 0 to 2 are Position, Altitude and Manual, which need sticks"""
_OFFBOARD_TO_PILOT = {0: px4.POSCTL, 1: px4.ALTCTL, 2: px4.MANUAL}
_GRAVITY = {WARN: 1, px4.LOITER: 3, px4.RTL: 4, px4.LAND: 5, TERMINATE: 7}
"""Of an action; the pilot's modes are in between"""
_PILOT_GRAVITY, _HOLD_GRAVITY = 2, 3
_NOT_FROM = {
    px4.LAND: (px4.RTL,),
    px4.PRECLAND: (px4.RTL, px4.LAND),
    px4.RTL: (px4.RTL,),
}
"""Modes that no failsafe flies instead of an intention to land or to return that can run"""


@dataclass(frozen=True)
class Action:
    """The action on one cause.

    Attributes:
        mode: that flies, or `WARN` or `TERMINATE`.
        lasts: until somebody chooses a mode or it is disarmed, though the cause be gone.
        waits: it holds for COM_FAIL_ACT_T first.
    """

    mode: int
    lasts: bool = False
    waits: bool = False

    @property
    def gravity(self) -> int:
        """The gravest flies."""
        return _GRAVITY.get(self.mode, _PILOT_GRAVITY)


def _lasting(mode: int) -> Action:
    """Until somebody chooses a mode; who flies it may take over before."""
    acts = mode not in (WARN, TERMINATE)
    return Action(mode, lasts=acts, waits=acts)


class Px4Failsafes(Failsafes):
    """Watches one vehicle."""

    _vehicle: Px4Vehicle

    def __init__(self, vehicle: Px4Vehicle) -> None:
        super().__init__(vehicle)
        self._gcs_was_alive = True
        self._hold_s, self._updated_s, self._revision = 0.0, 0.0, -1
        self._stop()

    def _stop(self) -> None:
        self.acting: int | None = None
        self._gravity = 0
        self._actions: dict[str, Action] = {}
        self._failing: set[str] = set()
        self._taken_over = False
        self._hold_until_s = -math.inf
        self._waits = False
        self._had_sticks = False

    @property
    def active(self) -> bool:
        """Whether HEARTBEAT says CRITICAL."""
        return self.acting is not None

    def forget(self) -> None:
        """Somebody has chosen a mode: it is theirs again."""
        self.acting, self._gravity, self._taken_over = None, 0, True
        self._actions = {c: a for c, a in self._actions.items() if c in self._failing}

    def gcs_alive(self) -> bool:
        """Whether a ground station was heard within COM_DL_LOSS_T; true before the first."""
        heard_s = self._gcs_heard_s
        limit_s = self._vehicle.parameters["COM_DL_LOSS_T"]
        return heard_s is None or self._vehicle.now_s - heard_s < limit_s

    def _say_regained(self) -> None:
        alive = self.gcs_alive()
        if alive and not self._gcs_was_alive:
            self._vehicle.say(Severity.INFO, "GCS connection regained")
        self._gcs_was_alive = alive

    def update(self, observation: Observation) -> None:
        """Look at the vehicle; act, or give the mode back."""
        self._battery_level()
        self._say_regained()
        self._refill()
        if not self._vehicle.armed:
            self._stop()
            return
        if self._holds_for_pilot():
            self._vehicle.intend(px4.LOITER)
        failures = dict(self._failures())
        for cause, action in failures.items():
            if cause not in self._failing:
                self._begin(action)
                self._actions[cause] = action
            elif cause in self._actions:
                self._actions[cause] = action
        self._actions = {c: a for c, a in self._actions.items() if c in failures or a.lasts}
        self._failing = set(failures)
        self._choose()

    def _refill(self) -> None:
        """Note how long it may hold the next time."""
        now_s, parameters = self._vehicle.now_s, self._vehicle.parameters
        most_s, passed_s = parameters["COM_FAIL_ACT_T"], now_s - self._updated_s
        self._updated_s = now_s
        if self._revision != parameters.revision:  # any of them begins it again
            self._revision, self._hold_s = parameters.revision, most_s
            return
        change_s = -passed_s if self._waits else _REFILL * passed_s
        self._hold_s = min(max(self._hold_s + change_s, 0.0), most_s)

    def _begin(self, action: Action) -> None:
        vehicle = self._vehicle
        if action.waits and self._hold_s > 0.1 and vehicle.now_s >= self._hold_until_s:
            self._hold_until_s = vehicle.now_s + self._hold_s
        if action.gravity >= _HOLD_GRAVITY:
            self._taken_over = False
        if action.mode == WARN and self._gravity <= action.gravity:
            vehicle.say(Severity.CRITICAL, "Failsafe activated")

    def _choose(self) -> None:
        """Fly the gravest action, or else the intended mode."""
        vehicle = self._vehicle
        self._waits = False
        self._taken_over = self._taken_over and bool(self._actions)
        worst = max(self._actions.values(), key=lambda action: action.gravity, default=None)
        runs = vehicle.can_run(vehicle.intention)
        kept = _NOT_FROM.get(vehicle.intention, ()) if runs else ()
        if worst is None or worst.mode in (WARN, *kept) or self._taken_over:
            if self.acting is not None:
                self.acting, self._gravity = None, 0
                vehicle.enter_mode(vehicle.intention)
            return
        if worst.mode == TERMINATE:
            vehicle.say(Severity.CRITICAL, "Failsafe activated")
            vehicle.terminate()
            return
        if self._gravity > _HOLD_GRAVITY:
            self._hold_until_s = -math.inf
        left_s = self._hold_until_s - vehicle.now_s
        self._waits = waiting = left_s > 0.0 and worst.gravity > _HOLD_GRAVITY
        mode = px4.LOITER if waiting else worst.mode
        gravity = _HOLD_GRAVITY if waiting else worst.gravity
        if gravity > self._gravity:
            hold = f": entering Hold for {int(left_s + 0.5)} seconds" if waiting else ""
            vehicle.say(Severity.CRITICAL, f"Failsafe activated{hold}")
        self._gravity = gravity
        if self.acting != mode:
            self.acting = mode
            vehicle.enter_mode(mode)

    # Failures, and the actions that they require.

    def _failures(self) -> Iterator[tuple[str, Action]]:
        vehicle, p = self._vehicle, self._vehicle.parameters
        fallback = self._fallback()
        if fallback is not None:
            yield f"mode {vehicle.intention}", Action(fallback)
        alive = vehicle.sticks.held() is not None
        self._had_sticks = self._had_sticks or alive
        if self._had_sticks and not alive:
            yield from self._link("sticks", int(p["NAV_RCL_ACT"]))
        if not self.gcs_alive() and vehicle.intention != px4.LAND:
            yield from self._link("ground station", int(p["NAV_DLL_ACT"]))
        if vehicle.fence.breached:
            mode = _FENCE.get(int(p["GF_ACTION"]), WARN)
            yield "fence", Action(mode, mode != WARN, mode in (px4.RTL, px4.LAND))
        battery = self._battery_action()
        if battery is not None:
            yield f"battery {self.battery_level}", Action(battery, waits=battery != WARN)
        yield from self._of_systems()

    def _of_systems(self) -> Iterator[tuple[str, Action]]:
        """Those of 1.18."""
        vehicle, p, systems = self._vehicle, self._vehicle.parameters, self._vehicle.systems
        for system, actions, name in (
            (PARACHUTE, _PARACHUTE, "COM_PARACHUTE"),
            (REMOTE_ID, _REMOTE_ID, "COM_ARM_ODID"),
        ):
            mode = actions.get(systems.value(name))
            if mode is not None and not systems.is_well(system):
                yield system, _lasting(mode)
        if p.acts("COM_GNSSLOSS_ACT") and not systems.has_receivers():
            yield "receivers", _lasting(_RECEIVERS.get(systems.value("COM_GNSSLOSS_ACT"), WARN))
        if systems.altitude_lost:
            early = vehicle.now_s < vehicle.arming.armed_at_s + p["COM_SPOOLUP_TIME"] + _EARLY_S
            warns = not early and p["CBRK_FLIGHTTERM"] == _NEVER_TERMINATES
            yield "altitude", Action(WARN if warns else TERMINATE)

    @staticmethod
    def _link(cause: str, parameter: int) -> Iterator[tuple[str, Action]]:
        mode = _LINK_LOSS.get(parameter)
        if mode is not None:
            yield cause, Action(mode, lasts=True, waits=True)

    def _holds_for_pilot(self) -> bool:
        vehicle = self._vehicle
        action = vehicle.parameters["NAV_RCL_ACT"]
        flown = vehicle.intention in px4.BY_STICKS and vehicle.sticks.held() is None
        return flown and action == HOLD_WITHOUT_FAILSAFE and vehicle.estimator.position_ok

    def _fallback(self) -> int | None:
        """The mode that replaces an intended mode that cannot run; None when it can."""
        vehicle, p = self._vehicle, self._vehicle.parameters
        if not vehicle.estimator.position_ok and (
            vehicle.mode.spec.requires_position or self.acting == px4.LAND
        ):
            return px4.LAND
        wanted = vehicle.intention
        if wanted == px4.OFFBOARD and not vehicle.stream_alive():
            action = int(p["COM_OBL_RC_ACT"])
            if action in _OFFBOARD_LOSS:
                return _OFFBOARD_LOSS[action]
            wanted = _OFFBOARD_TO_PILOT.get(action, px4.POSCTL)
            if vehicle.can_run(wanted):
                return wanted
        if wanted in px4.BY_STICKS and vehicle.sticks.held() is None:
            return _LINK_LOSS.get(int(p["NAV_RCL_ACT"]), px4.LOITER)
        return None

    def _battery_level(self) -> None:
        vehicle = self._vehicle
        p, left = vehicle.parameters, vehicle.battery.remaining
        thresholds = (p["BAT_LOW_THR"], p["BAT_CRIT_THR"], p["BAT_EMERGEN_THR"])
        level = sum(left < threshold for threshold in thresholds)
        if level > self.battery_level and vehicle.armed:
            word = ("Low", "Critical", "Emergency")[level - 1]
            severity = Severity.WARNING if level == 1 else Severity.CRITICAL
            vehicle.say(severity, f"{word} battery level")
        self.battery_level = level

    def _battery_action(self) -> int | None:
        """COM_LOW_BAT_ACT: 0 warns, 2 lands when critical, 3 returns, then lands."""
        if self.battery_level == 0:
            return None
        action = int(self._vehicle.parameters["COM_LOW_BAT_ACT"])
        if action not in (2, 3) or self.battery_level < 2:
            return WARN
        return px4.LAND if action == 2 or self.battery_level == 3 else px4.RTL
