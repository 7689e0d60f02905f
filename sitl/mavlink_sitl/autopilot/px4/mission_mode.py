"""AUTO.MISSION of PX4, whatever flies or drives. Seen in the recording `px4/mission_clear`.

The list, its order, jumps and conditions are `autopilot.auto`'s; what is said is PX4's: item 0
counts, nothing names the items, a mission that is cleared in flight ends in AUTO.LOITER.
"""

from __future__ import annotations

from mavlink_sitl.autopilot.auto import Auto
from mavlink_sitl.autopilot.auto_tasks import Task
from mavlink_sitl.autopilot.personality.px4 import LOITER
from mavlink_sitl.autopilot.plans import MissionState, PlanItem
from mavlink_sitl.autopilot.px4.mode import Px4Mode
from mavlink_sitl.exchange import Result, Severity


class Px4Mission(Px4Mode, Auto):
    """Carries out the uploaded mission."""

    @property
    def has_mission(self) -> bool:
        """Whether there is a mission, and a feasible one."""
        return super().has_mission and self.px4.feasibility.holds()

    def enter(self) -> None:
        """Take the mission up where it was left, or begin it."""
        self._announced = False
        Auto.enter(self)

    def update(self) -> None:
        """Go on with the item in force, or to the next."""
        if self.px4.armed and not self._announced and self.task is not None:
            self._announced = True
            self.announce()
        Auto.update(self)

    def announce(self) -> None:
        """It begins."""
        self.px4.say(Severity.INFO, "Executing Mission")

    def _say(self, seq: int, item: PlanItem) -> None:
        """PX4 names no items."""

    def _say_reached(self, place: int, item: PlanItem) -> None:
        """Nor that they are reached."""

    def _complete(self) -> None:
        """After the last item: stay in the mode and hold; landed, the commander disarms later."""
        ended, self.task = self.task is not None, None
        self.px4.plans.state = MissionState.COMPLETE
        self.guide(self.hold_guidance())
        if ended:
            self.px4.say(Severity.INFO, "Mission finished, loitering")

    def mission_changed(self) -> None:
        """Another list: begin it, or loiter when there is none."""
        if self.has_mission:
            self.start(self.px4.plans.current)
            return
        self.task = None
        if self.px4.armed:
            self.px4.say(Severity.CRITICAL, "No valid mission available, loitering")
            # Not where it stops, but where it was told: it comes back.
            self.px4.hold_at(self.here())

    def pause(self) -> Result:
        """DO_PAUSE_CONTINUE 0: AUTO.LOITER."""
        return self.px4.set_mode(LOITER)


class Delegate(Task):
    """What another mode does, within the mission.

    Args:
        mission: the mode.
        item: the item.
        mode: the other one.
    """

    def __init__(self, mission: Px4Mission, item: PlanItem, mode: Px4Mode) -> None:
        """See the class."""
        super().__init__(mission, item)
        self._mode = mode
        mode.enter()

    @property
    def landing(self) -> bool:
        """When that mode lands."""
        return self._mode.landing

    def update(self) -> None:
        """Go on."""
        self._mode.update()
