"""AUTO.MISSION of PX4, for all vehicle types. Seen in the recording `px4/mission_clear`.

The list, its order, jumps and conditions are `autopilot.auto`'s; what is said is PX4's: item 0
counts, nothing names the items, a mission that is cleared in flight ends in AUTO.LOITER.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from mavlink_sitl.autopilot.common.auto import Auto
from mavlink_sitl.autopilot.personality.px4 import LOITER, RTL
from mavlink_sitl.autopilot.plans.plans import Cmd, MissionState, PlanItem
from mavlink_sitl.autopilot.px4.mode import Px4Mode
from mavlink_sitl.exchange import ItemReached, Severity, Vector


class Px4Mission(Px4Mode, Auto, ABC):
    """Carries out the uploaded mission."""

    untold = frozenset()

    @property
    def has_mission(self) -> bool:
        """Whether there is a mission, and a feasible one."""
        return super().has_mission and self.vehicle.feasibility.holds()

    def enter(self) -> None:
        """Resume the mission where it was left, or begin it."""
        self._announced = self._returns = False
        Auto.enter(self)

    def update(self) -> None:
        """Run one step of the current item, or advance to the next."""
        if self.vehicle.armed and not self._announced and self.task is not None:
            self._announced = True
            self.announce()
        Auto.update(self)
        if self._returns and self.vehicle.armed:
            self._return_home()

    def announce(self) -> None:
        """It begins."""
        self.vehicle.say(Severity.INFO, "Executing Mission")

    def _do_waiting(self, conditions: bool = True) -> None:
        """Of items that are done at the same moment only the last is reported as reached."""
        if not self._waiting:
            return
        super()._do_waiting(conditions)
        events = self.vehicle.events
        for event in [event for event in events if isinstance(event, ItemReached)][:-1]:
            events.remove(event)

    def _say(self, seq: int, item: PlanItem) -> None:
        """PX4 names no items."""

    def _say_reached(self, place: int, item: PlanItem) -> None:
        """Nor that they are reached."""

    def _complete(self) -> None:
        """After the last item: AUTO.LOITER in the air; landed, the commander disarms later."""
        place, ended, self.task = self.last_place(), self.task is not None, None
        self._over()
        if not ended:
            self.guide(self.hold_guidance())
        elif self.vehicle.in_flight:
            self.vehicle.hold_at(place)

    def _over(self) -> None:
        self.vehicle.plans.state = MissionState.COMPLETE
        self.vehicle.say(Severity.INFO, "Mission finished, loitering")

    @abstractmethod
    def last_place(self) -> Vector:
        """Where the item in force is, NED metres; here without one."""

    def leave(self) -> None:
        """Another mode takes over: paused, once something of it has been flown."""
        plans = self.vehicle.plans
        if plans.state is MissionState.ACTIVE:
            plans.state = MissionState.PAUSED if plans.current else MissionState.NOT_STARTED

    def _begin(self, item: PlanItem) -> None:
        if item.command == Cmd.RTL:
            self.return_home()
        else:
            self._begin_moving(item)

    @abstractmethod
    def _begin_moving(self, item: PlanItem) -> None:
        """Begin an item that moves and is no RTL: give `task` a value."""

    def return_home(self) -> None:
        """An RTL item, once it is armed."""
        self.task, self._returns = None, True
        if self.vehicle.armed:
            self._return_home()

    def _return_home(self) -> None:
        """It counts as reached at once, ends the mission, and changes the mode."""
        self._returns = False
        self.vehicle.events.append(ItemReached(self.vehicle.plans.current))
        self._over()
        self.vehicle.after_disarming = LOITER
        self.vehicle.say(Severity.INFO, "Returning to launch")
        self.vehicle.intend(RTL)

    def mission_changed(self) -> None:
        """Another list, while it is flown: begin it, or loiter when there is none."""
        if self.vehicle.mode is not self:
            return
        if self.has_mission:
            self.start(self.vehicle.plans.current)
            return
        self.task = None
        if self.vehicle.armed:
            self.vehicle.say(Severity.CRITICAL, "No valid mission available, loitering")
            # Hold at the position of this moment: it overshoots and comes back.
            self.vehicle.hold_at(self.here())
