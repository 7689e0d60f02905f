"""AUTO of a copter. Seen in the recording `copter_auto_cleared`.

A waypoint without a delay is a corner to be cut; at others the vehicle stops. After the last
item it hovers.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.ardupilot.copter.copter_tasks import (
    CircleTask,
    FlyTo,
    LandAt,
    LegAuto,
    LoiterToAltitude,
    ReturnHome,
    TakeOffTask,
)
from mavlink_sitl.autopilot.ardupilot.copter.rtl import stopping_point
from mavlink_sitl.autopilot.common.auto import TAKE_OFFS, Delay
from mavlink_sitl.autopilot.plans.plan_commands import MOVING
from mavlink_sitl.autopilot.plans.plans import Cmd, MissionState, PlanItem
from mavlink_sitl.exchange import ZERO, Motors, Result, Vector

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.copter.copter import Copter

SPEEDS = {"WPNAV_SPEED": 1, "WPNAV_SPEED_UP": 2, "WPNAV_SPEED_DN": 3}
"""The parameters of the speeds, and SPEED_TYPE"""
STRAIGHT = (Cmd.WAYPOINT, Cmd.SPLINE, Cmd.LOITER_TIME, Cmd.LOITER_UNLIM)
"""The items that are flown to in a straight line, also a spline"""
ROI = frozenset((Cmd.SET_ROI, Cmd.SET_ROI_LOCATION, Cmd.SET_ROI_NONE))


class CopterAuto(LegAuto):
    """Flies the uploaded mission."""

    vehicle: Copter

    moving = MOVING | {Cmd.VTOL_TAKEOFF, Cmd.VTOL_LAND}

    _target: Vector
    """Where the item in force ends, NED metres"""
    _other_limits = False
    """They were changed in a pause"""

    _speeds: Mapping[int, float] = {}
    """The speeds of the parameters, when they were last looked at"""

    def enter(self) -> None:
        """See `Auto`; in the air, from where the vehicle stops (wp_and_spline_init)."""
        self._speeds = {}
        super().enter()
        if not self.vehicle.landed:
            self.guide(self.hold_guidance().exactly(stopping_point(self.vehicle), ZERO, ZERO))
            if isinstance(self.task, FlyTo):
                self.task.goes_on()

    def update(self) -> None:
        """See `Auto`."""
        self._follow_parameters()
        super().update()

    @property
    def taking_off(self) -> bool:
        """While the take-off climbs."""
        return isinstance(self.task, TakeOffTask)

    def ground_motors(self) -> Motors:
        """Only a take-off turns the motors up on the ground."""
        lifting = isinstance(self.task, TakeOffTask) and self.task.lifting
        return Motors.FLY if lifting else Motors.IDLE

    # The items.

    def _advance(self, place: int) -> None:
        """The next item; a heading that was asked for was for the way to the last one."""
        self.vehicle.yaw.forget_heading()
        super()._advance(place)

    def _do(self, item: PlanItem, begins: bool) -> bool:
        """CONDITION_YAW and regions of interest, besides what every vehicle does."""
        copter = self.vehicle
        if item.command == Cmd.CONDITION_YAW:
            if begins:
                copter.yaw.turn(copter.motion.yaw_rad, *item.params)
            return copter.yaw.reached(copter.motion.yaw_rad)
        if item.command in ROI and not copter.payload.has_gimbal:
            nowhere = item.command == Cmd.SET_ROI_NONE or not (item.x or item.y or item.z)
            copter.yaw.look_at(None if nowhere else self.place_of(item, copter.motion[:3]))
            return True
        return super()._do(item, begins)

    def _begin(self, item: PlanItem) -> None:
        start = self._start_point()
        old = self.task
        target = self.place_of(item, start)
        self._target = target
        command = item.command
        if command in TAKE_OFFS:
            self.task = TakeOffTask(self, item, target[2])
        elif command == Cmd.DELAY:
            self.task = Delay(self, item)
        elif command == Cmd.RTL:
            self.task = ReturnHome(self, item)
        elif command in (Cmd.LAND, Cmd.VTOL_LAND):
            self.task = LandAt(self, item, start, target, moves=item.has_place)
        elif command == Cmd.LOITER_TURNS:
            self.task = CircleTask(self, item, start, target)
        elif command == Cmd.LOITER_TO_ALT:
            self.task = LoiterToAltitude(self, item, start, target)
        else:
            self.task = FlyTo(self, item, start, target)
            if isinstance(old, FlyTo):
                self.task.continue_from(old)

    def _start_point(self) -> Vector:
        """Where the next leg begins: at the end of the last, or where the vehicle can stop."""
        if isinstance(self.task, (FlyTo, TakeOffTask)):
            return self.task.target
        return stopping_point(self.vehicle)

    def following_leg(self) -> FlyTo | None:
        """The leg to the next item, if that is flown to without stopping here."""
        straight = (i for i in self.following_items() if i.command in STRAIGHT)
        item = next(straight, None)
        if item is None:
            return None
        return FlyTo(self, item, self._target, self.place_of(item, self._target))

    # Requests by people.

    def _following_changed(self) -> None:
        if isinstance(self.task, FlyTo):
            self.task.forget_following()

    def limits_changed(self) -> None:
        """Another speed: the leg continues with it, after a pause if there is one."""
        if isinstance(self.task, FlyTo) and not self.paused:
            self.task.change_limits()
        self._other_limits = self.paused

    def _follow_parameters(self) -> None:
        """A speed that is set as a parameter counts at once, whatever was asked for before."""
        parameters, navigator = self.vehicle.parameters, self.vehicle.navigator
        speeds = {kind: parameters[name] for name, kind in SPEEDS.items()}
        changed = [kind for kind, speed in speeds.items() if speed != self._speeds.get(kind, speed)]
        self._speeds = speeds
        for kind in changed:
            navigator.forget_speed(kind)
        if changed:
            self.limits_changed()

    def pause(self) -> Result:
        """DO_PAUSE_CONTINUE 0: slow down along the way to a stand, and hold."""
        if not isinstance(self.task, FlyTo):
            return super().pause()
        self.paused = True
        self.vehicle.plans.state = MissionState.PAUSED
        return Result.ACCEPTED

    def go_on(self) -> Result:
        """DO_PAUSE_CONTINUE 1."""
        if self.paused and isinstance(self.task, FlyTo):
            self.paused = False
            self.vehicle.plans.state = MissionState.ACTIVE
            if self._other_limits:
                self.task.restart()
                self._other_limits = False
        return Result.ACCEPTED
