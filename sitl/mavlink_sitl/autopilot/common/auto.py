"""AUTO: carries out the mission item by item, for all vehicle types.

From the recordings `copter_auto_cleared` and `rover_auto`, and from the firmware's source:

* Items that move (waypoints, loiters, take-off, landing) follow one another.
* Those that only do something (`DO_*`) and conditions (`CONDITION_*`) are done on the way to
  the next one that moves, in their order. Those that are not done yet when it ends are dropped.
* An item that moves is reported as reached under the number of what is done at once after it
  (`copter_mission_rich`, `rover_mission`, `plane_auto`): the firmware's message is overwritten
  before it is sent. Items that its mission library does itself, as servos, are never reported.
* When AUTO is entered again, the mission resumes at the item at which it was left.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.devices import aux_functions
from mavlink_sitl.autopilot.plans.plan_commands import CONDITIONS, MOVING, NAMES, UNTOLD
from mavlink_sitl.autopilot.plans.plans import Cmd, MissionState, PlanItem
from mavlink_sitl.autopilot.state.mode import Mode
from mavlink_sitl.exchange import ItemReached, Result, Severity, Vector
from mavlink_sitl.geodesy import GeoPoint

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander
    from mavlink_sitl.autopilot.personality import ModeSpec

TAKE_OFFS = (Cmd.TAKEOFF, Cmd.VTOL_TAKEOFF)
MOST_STEPS = 200
"""A mission of nothing but jumps ends after this many"""


class Auto(Mode):
    """Carries out the uploaded mission; how an item is flown is the subclasses'.

    Attributes:
        moving: the items that move this vehicle type.
        untold: the items that are never reported as reached.
        task: what it is busy with; None without a mission, or after its end.
        paused: whether DO_PAUSE_CONTINUE has paused it.
    """

    moving = MOVING
    untold: frozenset[int] = UNTOLD

    def __init__(self, vehicle: Commander, spec: ModeSpec) -> None:
        super().__init__(vehicle, spec)
        self.task: AutoTask | None = None
        self.may_take_off = False
        self.paused = False
        self._waiting: list[tuple[int, PlanItem]] = []
        self._doing_since_s: float | None = None

    @property
    def _first(self) -> int:
        return int(self.vehicle.personality.plan_rules.home_first)

    @property
    def has_mission(self) -> bool:
        """Whether there is anything to fly."""
        return len(self.vehicle.plans.mission.items) > self._first

    @property
    def starts_with_takeoff(self) -> bool:
        """Whether the first item that moves, from the one in force on, leaves the ground."""
        plans = self.vehicle.plans
        start = self._first if self._begins_again else max(plans.current, self._first)
        moving = (i.command for i in plans.mission.items[start:] if i.command in self.moving)
        return next(moving, None) in TAKE_OFFS

    @property
    def _begins_again(self) -> bool:
        """MIS_RESTART, where the firmware has it: the mission begins again in each time in AUTO."""
        parameters = self.vehicle.parameters
        return "MIS_RESTART" in parameters and parameters["MIS_RESTART"] == 1.0

    # The mode.

    def enter(self) -> None:
        """Resume the mission where it was left, or begin it."""
        if self._begins_again:
            self.vehicle.plans.rewind()
        self.task = None
        self.paused = False
        self._waiting = []
        self.may_take_off = False
        self.guide(self.hold_guidance())
        if self.has_mission:
            self.start(self.vehicle.plans.first_to_do)

    def leave(self) -> None:
        """Another mode takes over: the mission waits."""
        plans = self.vehicle.plans
        if plans.state in (MissionState.ACTIVE, MissionState.PAUSED):
            plans.state = MissionState.NOT_STARTED

    def start(self, place: int) -> None:
        """Continue with an item; from the beginning after the end."""
        plans = self.vehicle.plans
        if plans.state is MissionState.COMPLETE or not (
            self._first <= place < len(plans.mission.items)
        ):
            plans.rewind()
            place = self._first
        plans.state = MissionState.ACTIVE
        self._advance(place)

    def update(self) -> None:
        """Run one step of the current item, or advance to the next."""
        task = self.task
        if task is None:
            return
        if self.vehicle.plans.current < self._first:
            self.may_take_off = False  # disarming has rewound it under way
            self.start(self._first)
            return
        if self.paused:
            task.update()  # to a stand, on its way
            return
        self._do_waiting()
        task.update()
        if task.finished():
            self._finish(task)

    @property
    def landing(self) -> bool:
        """While it sinks to land."""
        return self.task is not None and self.task.landing

    # The items.

    def _finish(self, task: AutoTask) -> None:
        place = self.vehicle.plans.current
        passed = ItemReached(place)
        self.vehicle.events.append(passed)
        self._say_reached(place, task.item)
        self._advance(place + 1)
        events = self.vehicle.events
        reached = [event for event in events if isinstance(event, ItemReached)]
        if passed in reached[:-1]:
            events.remove(passed)

    def _say_reached(self, place: int, item: PlanItem) -> None:
        if item.command in (Cmd.WAYPOINT, Cmd.LOITER_TIME):
            self.vehicle.say(Severity.INFO, f"Reached command #{place}")

    def _advance(self, place: int) -> None:
        """Begin the next item that moves, from a place on."""
        plans = self.vehicle.plans
        self._waiting = []
        self._doing_since_s = None
        plans.begins = (0, 0)
        for seq, item in self._walk(place, plans.jumps):
            if item.command not in self.moving:
                self._waiting.append((seq, item))
                continue
            self._do_waiting(conditions=False)
            plans.current = seq
            self._say(seq, item)
            self._begin(item)
            self._do_waiting()
            return
        self._do_waiting()
        self._complete()

    def _walk(self, place: int, jumps: dict[int, int]) -> list[tuple[int, PlanItem]]:
        """The items from a place up to the next that moves, following jumps."""
        items = self.vehicle.plans.mission.items
        found: list[tuple[int, PlanItem]] = []
        for _ in range(MOST_STEPS):
            if not self._first <= place < len(items):
                break
            item = items[place]
            if item.command in (Cmd.JUMP, Cmd.DO_JUMP_TAG):
                place = self._jump(place, item, jumps)
                continue
            found.append((place, item))
            if item.command in self.moving:
                return found
            place += 1
        return found

    def following_items(self) -> list[PlanItem]:
        """The items after the one in force, up to the next that moves; uses up no jumps."""
        plans = self.vehicle.plans
        return [item for _, item in self._walk(plans.current + 1, dict(plans.jumps))]

    def next_moving(self, place: int) -> int | None:
        """The first item to fly to from a place on; None if the mission ends before it."""
        walked = self._walk(max(place, self._first), dict(self.vehicle.plans.jumps))
        last = walked[-1] if walked else None
        return last[0] if last is not None and last[1].command in self.moving else None

    def _jump(self, place: int, item: PlanItem, jumps: dict[int, int]) -> int:
        items = self.vehicle.plans.mission.items
        target, times = int(item.params[0]), int(item.params[1])
        if item.command == Cmd.DO_JUMP_TAG:
            tagged = self.vehicle.plans.place_of_tag(target)
            target = -1 if tagged is None else tagged
        taken = jumps.get(place, 0)
        if not self._first <= target < len(items):
            return len(items)  # to nowhere: it ends
        if 0 <= times <= taken:
            return place + 1
        jumps[place] = taken + 1
        return target

    def _say(self, seq: int, item: PlanItem) -> None:
        self.vehicle.say(Severity.INFO, f"Mission: {seq} {NAMES.get(item.command, item.command)}")

    def _complete(self) -> None:
        """After the last item: hover, or rest on the ground."""
        self.vehicle.plans.state = MissionState.COMPLETE
        self.task = None
        self.guide(self.hold_guidance())
        if self.vehicle.landed and self.vehicle.armed:
            self.vehicle.disarm(force=True)

    def _do_waiting(self, conditions: bool = True) -> None:
        """Do what is to be done on the way; a condition holds up what comes after it."""
        while self._waiting:
            seq, item = self._waiting[0]
            if item.command in CONDITIONS and not conditions:
                return
            begins = self._doing_since_s is None
            if begins:
                self._doing_since_s = self.vehicle.now_s
                self._say(seq, item)
            if not self._do(item, begins):
                return
            self._doing_since_s = None
            self._waiting.pop(0)
            if item.command not in self.untold:
                self.vehicle.events.append(ItemReached(seq))

    def _do(self, item: PlanItem, begins: bool) -> bool:
        """Do an item that does not move, or look at a condition.

        Args:
            item: the item; what needs a device that the vehicle does not have is passed over.
            begins: whether this is the first time.
        """
        vehicle, command, value = self.vehicle, item.command, item.params[0]
        if command == Cmd.CONDITION_DELAY:
            return vehicle.now_s - (self._doing_since_s or 0.0) >= value
        if command == Cmd.CONDITION_DISTANCE:
            return self.distance_left_m() <= value
        if command == Cmd.CHANGE_SPEED:
            self._change_speed(int(value), item.params[1])
        elif command == Cmd.SET_HOME:
            vehicle.set_home(None if value == 1.0 else self._point_of(item))
        elif command == Cmd.SET_SERVO:
            vehicle.outputs.set_servo(int(value), item.params[1])
        elif command == Cmd.AUX_FUNCTION:
            aux_functions.run(vehicle, int(value), int(item.params[1]))
        elif command == Cmd.FENCE_ENABLE and value in (0.0, 1.0):
            vehicle.fence.enable(value == 1.0)
        else:
            vehicle.payload.do(item, self._point_of(item))
        return True

    def _change_speed(self, kind: int, speed_m_s: float) -> None:
        self.vehicle.navigator.change_speed(kind, speed_m_s)
        self.limits_changed()

    def _begin(self, item: PlanItem) -> None:
        """Begin an item that moves: give `task` a value."""
        raise NotImplementedError

    def distance_left_m(self) -> float:
        """The distance over ground to the position of the current item."""
        if self.task is None:
            return 0.0
        here = self.vehicle.motion[:3]
        return math.dist(here[:2], self.place_of(self.task.item, here)[:2])

    def _point_of(self, item: PlanItem) -> GeoPoint | None:
        """Where an item is on earth; None for the vehicle's own place, which zeros mean."""
        if not item.has_place:
            return None
        altitude_m = item.z
        if not item.is_amsl:
            altitude_m += (self.vehicle.navigator.home or self.vehicle.navigator.origin)[2]
        return GeoPoint(item.x / 1e7, item.y / 1e7, altitude_m)

    def place_of(self, item: PlanItem, instead: Vector) -> Vector:
        """Where an item is, NED metres; zeros in it mean `instead`."""
        frame = self.vehicle.navigator.frame
        north, east = item.level_m(frame) if item.has_place else instead[:2]
        if item.z == 0.0 and item.command not in TAKE_OFFS:
            return north, east, instead[2]
        return north, east, self._down_m(item)

    def _down_m(self, item: PlanItem) -> float:
        """The height in an item, NED."""
        navigator = self.vehicle.navigator
        if item.is_amsl:
            return navigator.origin.altitude_amsl_m - item.z
        return navigator.home_ned_m()[2] - item.z

    # Requests by people.

    def mission_changed(self) -> None:
        """The list has another content: begin the item in force again, if it is still there."""
        plans = self.vehicle.plans
        if self.vehicle.mode is not self or self.task is None:
            return
        if self._first <= plans.current < len(plans.mission.items):
            item = plans.mission.items[plans.current]
            self._say(plans.current, item)
            text = "Auto mission changed, restarted command"
            if item != self.task.item and item.command in self.moving:
                self.task = None
                self._begin(item)
            else:
                self._following_changed()
        else:
            text = "Auto mission changed but failed to restart command"
        self.vehicle.say(Severity.CRITICAL, text)

    def set_current(self, seq: int) -> Result:
        """DO_SET_MISSION_CURRENT and MISSION_SET_CURRENT.

        While it flies the mission continues there, or ends if no waypoint follows. In other modes
        the next item to fly to is the current one; FAILED without one.
        """
        plans = self.vehicle.plans
        if not 0 <= seq < len(plans.mission.items):
            return Result.DENIED
        place = self.next_moving(seq)
        if self.vehicle.mode is self:
            self.jump_to(max(seq, self._first))
        elif seq and place is not None:
            plans.current, plans.begins = place, (seq, place)
        elif not seq:
            plans.current = 0
        return Result.FAILED if place is None and seq else Result.ACCEPTED

    def clear(self) -> None:
        """Forget the mission; while it flies it continues to the end of the leg."""
        self.vehicle.plans.mission.replace([])
        self.vehicle.plans.forget_progress()
        self.vehicle.saved.mission_length(0)
        self.mission_changed()

    def append_here(self, command: Cmd) -> None:
        """Append an item to the mission, at the vehicle's place and height above home."""
        navigator, mission, m = (
            self.vehicle.navigator,
            self.vehicle.plans.mission,
            self.vehicle.motion,
        )
        if not mission.items:
            mission.put(0, PlanItem(Cmd.WAYPOINT, 0))
        place = navigator.frame.to_geodetic(m.north_m, m.east_m, m.down_m)
        x, y = round(place.latitude_deg * 1e7), round(place.longitude_deg * 1e7)
        item = PlanItem(command, x=x, y=y, z=navigator.height_above_home_m())
        mission.put(len(mission.items), item)
        self.vehicle.saved.mission_length(len(mission.items))

    def jump_to(self, place: int) -> None:
        """Continue with another item while it flies; that ends a pause."""
        self._waiting = []
        self.paused = False
        self.vehicle.plans.state = MissionState.ACTIVE
        if self.task is not None and not self.taking_off:
            self.task = None  # the old leg's end is not where the new one begins
        self._advance(place)

    def _following_changed(self) -> None:
        """React to a possible change of the item after the one in force."""

    def limits_changed(self) -> None:
        """Another speed: the item continues with it."""

    def pause(self) -> Result:
        """DO_PAUSE_CONTINUE 0: not possible."""
        self.vehicle.say(Severity.INFO, "Failed to pause")
        return Result.FAILED

    def go_on(self) -> Result:
        """DO_PAUSE_CONTINUE 1."""
        return Result.ACCEPTED


class AutoTask:
    """An item in flight."""

    _there_s: float | None = None
    """When it was first there"""

    def __init__(self, auto: Auto, item: PlanItem) -> None:
        self.auto = auto
        self.vehicle = auto.vehicle
        self.item = item

    @property
    def landing(self) -> bool:
        """Whether it sinks to land."""
        return False

    def update(self) -> None:
        """Run one step; called at the autopilot's rate."""

    def finished(self) -> bool:
        """Whether the next item's turn has come."""
        return False

    def stayed(self, there: bool, seconds: float) -> bool:
        """Whether a time has passed since it was first there, given whether it is there now."""
        now_s = self.vehicle.now_s
        if self._there_s is None and there:
            self._there_s = now_s
        return self._there_s is not None and now_s - self._there_s >= seconds


class Delay(AutoTask):
    """Stay for param1 seconds."""

    def __init__(self, auto: Auto, item: PlanItem) -> None:
        super().__init__(auto, item)
        self._until_s = self.vehicle.now_s + max(item.params[0], 0.0)
        auto.guide(auto.hold_guidance())

    def finished(self) -> bool:
        """When it ends."""
        return self.vehicle.now_s >= self._until_s
