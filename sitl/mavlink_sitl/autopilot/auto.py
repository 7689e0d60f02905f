"""AUTO: flies the mission, item by item. Seen in the recording `copter_auto_cleared`.

* Items that move (waypoints, loiters, take-off, landing) follow one another; those that only
  do something (`DO_*`) are done on the way to the next one that moves.
* A waypoint without a delay is a corner to be cut; at others the vehicle stops.
* Left half-way, it is taken up at the same item; after the last item the vehicle hovers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.auto_tasks import (
    Circle,
    Delay,
    FlyTo,
    LandAt,
    ReturnHome,
    TakeOff,
    Task,
    stopping_point,
)
from mavlink_sitl.autopilot.modes import Mode
from mavlink_sitl.autopilot.plans import Cmd, MissionState, PlanItem
from mavlink_sitl.autopilot.track import Vector
from mavlink_sitl.exchange import ItemReached, Motors, Result, Severity
from mavlink_sitl.geodesy import GeoPoint, to_local

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.copter import Copter
    from mavlink_sitl.autopilot.personality import ModeSpec

NAMES = {
    Cmd.WAYPOINT: "WP",
    Cmd.LOITER_UNLIM: "LoitUnlim",
    Cmd.LOITER_TURNS: "LoitTurns",
    Cmd.LOITER_TIME: "LoitTime",
    Cmd.RTL: "RTL",
    Cmd.LAND: "Land",
    Cmd.TAKEOFF: "Takeoff",
    Cmd.DELAY: "Delay",
    Cmd.CONDITION_DELAY: "CondDelay",
    Cmd.CONDITION_DISTANCE: "CondDist",
    Cmd.CONDITION_YAW: "CondYaw",
    Cmd.JUMP: "Jump",
    Cmd.CHANGE_SPEED: "ChangeSpeed",
}
"""As 'Mission: 2 WP' says them"""

MOVING = frozenset(
    (
        Cmd.WAYPOINT,
        Cmd.LOITER_UNLIM,
        Cmd.LOITER_TURNS,
        Cmd.LOITER_TIME,
        Cmd.RTL,
        Cmd.LAND,
        Cmd.TAKEOFF,
        Cmd.DELAY,
    )
)
AMSL_FRAMES = (0, 2, 5)
MOST_STEPS = 200
"""A mission of nothing but jumps ends after so many"""
ALLOW_ARMING = 1
"""Bit of AUTO_OPTIONS"""


class Auto(Mode):
    """Flies the uploaded mission.

    Attributes:
        task: what it is busy with; None without a mission, or after its end.
    """

    def __init__(self, copter: Copter, spec: ModeSpec) -> None:
        """See the class."""
        super().__init__(copter, spec)
        self.task: Task | None = None
        self.may_take_off = False
        self._paused = False
        self._waiting: list[tuple[int, PlanItem]] = []
        self._target: Vector = (0.0, 0.0, 0.0)
        self._held_since_s: float | None = None

    @property
    def _first(self) -> int:
        return int(self.copter.personality.plan_rules.home_first)

    @property
    def has_mission(self) -> bool:
        """Whether there is anything to fly."""
        return len(self.copter.plans.mission.items) > self._first

    @property
    def starts_with_takeoff(self) -> bool:
        """Whether the first item that moves, from the one in force on, leaves the ground."""
        plans = self.copter.plans
        start = max(plans.current, self._first)
        moving = (i.command for i in plans.mission.items[start:] if i.command in MOVING)
        return next(moving, None) == Cmd.TAKEOFF

    # The mode.

    def enter(self) -> None:
        """Take the mission up where it was left, or begin it."""
        self.task = None
        self._paused = False
        self._waiting = []
        self.may_take_off = False
        motion = self.copter.motion
        self._target = motion[:3]
        self.guide(self.hold_guidance())
        if self.has_mission:
            self.start(self.copter.plans.current)

    def leave(self) -> None:
        """Another mode takes over: the mission waits."""
        plans = self.copter.plans
        if plans.state is MissionState.ACTIVE:
            plans.state = MissionState.NOT_STARTED

    def start(self, place: int) -> None:
        """Go on with an item; from the beginning after the end."""
        plans = self.copter.plans
        if plans.state is MissionState.COMPLETE or not (
            self._first <= place < len(plans.mission.items)
        ):
            plans.rewind()
            place = self._first
        plans.state = MissionState.ACTIVE
        self._advance(place)

    def update(self) -> None:
        """Go on with the item in force, or to the next."""
        task = self.task
        if task is None or self._paused:
            return
        self._do_waiting()
        task.update()
        if task.finished():
            self._finish(task)

    @property
    def taking_off(self) -> bool:
        """While the take-off climbs."""
        return isinstance(self.task, TakeOff)

    @property
    def landing(self) -> bool:
        """While it sinks to land."""
        return self.task is not None and self.task.landing

    def ground_motors(self) -> Motors:
        """Only a take-off turns the motors up on the ground."""
        lifting = isinstance(self.task, TakeOff) and self.task.lifting
        return Motors.FLY if lifting else Motors.IDLE

    # The items.

    def _finish(self, task: Task) -> None:
        place = self.copter.plans.current
        self.copter.events.append(ItemReached(place))
        self._say_reached(place, task.item)
        self._advance(place + 1)

    def _say_reached(self, place: int, item: PlanItem) -> None:
        if item.command in (Cmd.WAYPOINT, Cmd.LOITER_TIME):
            self.copter.say(Severity.INFO, f"Reached command #{place}")

    def _advance(self, place: int) -> None:
        """Begin the next item that moves, from a place on."""
        plans = self.copter.plans
        for seq, item in self._walk(place, plans.jumps):
            if item.command not in MOVING:
                self._waiting.append((seq, item))
                self._say(seq, item)
                continue
            plans.current = seq
            self._say(seq, item)
            self._do_waiting()
            self._begin(item)
            return
        self._do_waiting()
        self._complete()

    def _walk(self, place: int, jumps: dict[int, int]) -> list[tuple[int, PlanItem]]:
        """The items from a place up to the next that moves, following jumps."""
        items = self.copter.plans.mission.items
        found: list[tuple[int, PlanItem]] = []
        for _ in range(MOST_STEPS):
            if not self._first <= place < len(items):
                break
            item = items[place]
            if item.command == Cmd.JUMP:
                place = self._jump(place, item, jumps)
                continue
            found.append((place, item))
            if item.command in MOVING:
                return found
            place += 1
        return found

    def _jump(self, place: int, item: PlanItem, jumps: dict[int, int]) -> int:
        target, times = int(item.params[0]), int(item.params[1])
        taken = jumps.get(place, 0)
        valid = self._first <= target < len(self.copter.plans.mission.items)
        if not valid or 0 <= times <= taken:
            return place + 1
        jumps[place] = taken + 1
        return target

    def _say(self, seq: int, item: PlanItem) -> None:
        name = NAMES.get(Cmd(item.command), "") if item.command in NAMES else str(item.command)
        self.copter.say(Severity.INFO, f"Mission: {seq} {name}")

    def _complete(self) -> None:
        """After the last item: hover, or rest on the ground."""
        self.copter.plans.state = MissionState.COMPLETE
        self.task = None
        self.guide(self.hold_guidance())
        if self.copter.landed and self.copter.armed:
            self.copter.disarm(force=True)

    def _do_waiting(self) -> None:
        """Do what only takes a moment; a condition holds up what comes after it."""
        while self._waiting:
            seq, item = self._waiting[0]
            if item.command == Cmd.CONDITION_DELAY:
                if self._held_since_s is None:
                    self._held_since_s = self.copter.now_s
                if self.copter.now_s - self._held_since_s < item.params[0]:
                    return
                self._held_since_s = None
            elif item.command == Cmd.CHANGE_SPEED:
                self.copter.navigator.change_speed(int(item.params[0]), item.params[1])
                self.limits_changed()
            self._waiting.pop(0)
            self.copter.events.append(ItemReached(seq))

    def _begin(self, item: PlanItem) -> None:
        start = self._start_point()
        old = self.task
        target = self.place_of(item, start)
        self._target = target
        command = item.command
        if command == Cmd.TAKEOFF:
            self.task = TakeOff(self, item, target[2])
        elif command == Cmd.DELAY:
            self.task = Delay(self, item)
        elif command == Cmd.RTL:
            self.task = ReturnHome(self, item)
        elif command == Cmd.LAND:
            self.task = LandAt(self, item, start, target, moves=bool(item.x or item.y))
        elif command == Cmd.LOITER_TURNS:
            self.task = Circle(self, item, start, target)
        else:
            self.task = FlyTo(self, item, start, target)
            if isinstance(old, FlyTo):
                self.task.continue_from(old)

    def _start_point(self) -> Vector:
        """Where the next leg begins: at the end of the last, or where the vehicle can stop."""
        if isinstance(self.task, (FlyTo, TakeOff)):
            return self.task.target
        return stopping_point(self.copter)

    def following_leg(self) -> FlyTo | None:
        """The next item, if it is one to fly to without stopping here."""
        place = self.copter.plans.current
        # A look ahead must not use up jumps.
        for _, item in self._walk(place + 1, dict(self.copter.plans.jumps)):
            if item.command in (Cmd.WAYPOINT, Cmd.LOITER_TIME, Cmd.LOITER_UNLIM):
                return FlyTo(self, item, self._target, self.place_of(item, self._target))
        return None

    def place_of(self, item: PlanItem, instead: Vector) -> Vector:
        """Where an item is, NED metres; zeros in it mean `instead`."""
        navigator = self.copter.navigator
        point = GeoPoint(item.x / 1e7, item.y / 1e7, 0.0)
        north, east, _ = to_local(navigator.origin, point)
        if not item.x and not item.y:
            north, east = instead[:2]
        down = navigator.home_ned_m()[2] - item.z
        if item.frame in AMSL_FRAMES:
            down = navigator.origin.altitude_amsl_m - item.z
        if item.z == 0.0 and item.command != Cmd.TAKEOFF:
            down = instead[2]
        return north, east, down

    # What people want of it.

    def mission_changed(self) -> None:
        """The list has another content: begin the item in force again, if it is still there."""
        plans = self.copter.plans
        if self.task is None:
            return
        if self._first <= plans.current < len(plans.mission.items):
            item = plans.mission.items[plans.current]
            self._say(plans.current, item)
            text = "Auto mission changed, restarted command"
            if item != self.task.item and item.command in MOVING:
                self.task = None
                self._begin(item)
            elif isinstance(self.task, FlyTo):
                self.task.forget_following()
        else:
            text = "Auto mission changed but failed to restart command"
        self.copter.say(Severity.CRITICAL, text)

    def jump_to(self, place: int) -> None:
        """DO_SET_MISSION_CURRENT and MISSION_SET_CURRENT while it flies."""
        self._waiting = []
        self.copter.plans.state = MissionState.ACTIVE
        if self.task is not None and not self.taking_off:
            self.task = None  # the old leg's end is not where the new one begins
        self._advance(place)

    def limits_changed(self) -> None:
        """Another speed: the leg goes on with it."""
        if isinstance(self.task, FlyTo) and not self._paused:
            self.task.restart()

    def pause(self) -> Result:
        """DO_PAUSE_CONTINUE 0: stop and hold."""
        if self.task is None or not isinstance(self.task, FlyTo):
            self.copter.say(Severity.INFO, "Failed to pause")
            return Result.FAILED
        self._paused = True
        self.guide(self.hold_guidance())
        return Result.ACCEPTED

    def go_on(self) -> Result:
        """DO_PAUSE_CONTINUE 1."""
        if self._paused and isinstance(self.task, FlyTo):
            self._paused = False
            self.task.restart()
        return Result.ACCEPTED
