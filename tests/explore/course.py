"""The course of an exploration so far, as policies look at it: one `Craft` view per vehicle."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from mavlink_vehicle.codec import Message, mavlink
from navigation_bridge.configuration.make_config import ServerConfig, make_config
from navigation_bridge.goals.goal import (
    GoalFeedback,
    GoalFinished,
    GoalHappened,
    PlanChanged,
    ServiceDone,
)
from navigation_bridge.goals.requests import LandRequest, Request, WaypointsRequest
from navigation_core.geometry import Vector3
from navigation_core.tasks.progress import Status
from tests.explore.log import NOBODY, Asked, Entry, Met, PayloadAsked, PayloadEnded, Truth
from tests.explore.scenario import Craft, Event, Post, Scenario

SETPOINTS = ("SET_POSITION_TARGET_LOCAL_NED", "SET_POSITION_TARGET_GLOBAL_INT")
COMMANDS = ("COMMAND_LONG", "COMMAND_INT")
_TAKERS = frozenset(
    {"pilot_mode", "pilot_stick", "station_mode", "station_goto", "station_pause", "reboot"}
)
_CIRCLE_GAP_S = 1.0
# After the last velocity command: what stands still does, and a plane circles.
_RELEASED_S = 10.0
_STORING = frozenset({"station_clear", "station_upload", "station_current"})
_TROUBLE = frozenset(
    {
        *("link", "silence", "gps", "glitch", "battery", "radio", "wind", "reboot", "stall"),
        *("kill", "noise", "pilot_throttle", "station_arm", "full", "stuck", "blind"),
        *("lie", "misreport", "aircraft"),
        "unlocated",
    }
)
_OVER: dict[str, Callable[[dict[str, Any]], bool]] = {
    "link": lambda how: not how,
    **dict.fromkeys(
        ("silence", "full", "stuck", "blind", "unlocated"), lambda how: not how.get("on", True)
    ),
    **dict.fromkeys(("gps", "radio"), lambda how: not how.get("lost", True)),
    "glitch": lambda how: not any(how.get("offset", (1.0,))),
    "lie": lambda how: not how.get("period"),
    **dict.fromkeys(("misreport", "aircraft"), lambda how: not how.get("claim")),
}
"""Trouble that passes, and of the arguments of its event whether it is over"""
_DENIED: dict[str, Callable[[Truth], bool]] = {
    "disarmed": lambda truth: truth.armed,
    "armed": lambda truth: not truth.armed,
    "landed": lambda truth: not truth.on_ground,
    "down": lambda truth: truth.armed and not truth.on_ground,
    "airborne": lambda truth: truth.on_ground,
    "no fix": lambda _: True,
    "elsewhere": lambda truth: truth.armed and not truth.on_ground,
}
"""The lies that the vehicle's own reports deny again and again, and when they do"""
_OF_FLYING = frozenset({"landed", "down", "airborne"})


@dataclass
class Goal:
    """A goal that was accepted.

    Attributes:
        goal_id: its id.
        request: what was asked.
        accepted_s: when.
        ends: its results.
        ended_s: time of the first; infinite before.
        feedback: the last one.
        feedback_s: its time.
        cancel_s: when a client cancelled it; infinite if none did.
        paused_s: since when a client has paused it; infinite if none has.
        disturbed: whether anything but clients acted on the vehicle meanwhile.
        happened: the events that were published about it.
        begun: the true state at acceptance.
        stored: whether a mission was sent for it.
        cleared: whether the mission was removed for it.
        paused: whether PAUSED was ever reported.
        nearest_m: of a route, how near to each waypoint the vehicle has truly been, level.
    """

    goal_id: str
    request: Request
    accepted_s: float
    ends: list[GoalFinished] = field(default_factory=list)
    ended_s: float = math.inf
    feedback: GoalFeedback | None = None
    feedback_s: float = -math.inf
    cancel_s: float = math.inf
    paused_s: float = math.inf
    disturbed: bool = False
    happened: list[str] = field(default_factory=list)
    begun: Truth | None = None
    stored: bool = False
    cleared: bool = False
    paused: bool = False
    nearest_m: dict[int, float] = field(default_factory=dict)

    def pass_by(self, position_enu_m: Sequence[float]) -> None:
        """Measure how near a vehicle comes to the waypoints of its route."""
        if isinstance(self.request, WaypointsRequest):
            for index, waypoint in enumerate(self.request.waypoints):
                away_m = math.dist(waypoint.position[:2], position_enu_m[:2])
                self.nearest_m[index] = min(self.nearest_m.get(index, math.inf), away_m)

    @property
    def by_mission(self) -> bool:
        """Whether the autopilot flies it."""
        return isinstance(self.request, WaypointsRequest) and self.request.by_mission


NO_GOAL = Goal("", LandRequest(), -math.inf, disturbed=True)
UNSEEN = Truth((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), True, False, "", False, math.inf)


@dataclass
class View:
    """The knowledge about one vehicle and its server at a moment.

    Attributes:
        craft: of the scenario.
        config: of the server.
        posts: that stand around.
        wind_m_s: steady wind.
        gust_m_s: standard deviation of the gusts.
        goals: all accepted goals of this server's life, by id.
        active: the goal that is flown.
        last: the goal that ended last.
        truth: the last true state.
        moved_homes_enu_m: where a ground station has set home.
        homes_up_m: by how much home is or was above where the vehicle began.
        set_s: when a ground station has set a parameter or home last.
        homes_enu_m: where it was armed last, where home was set, and where a PX4 has left the
            ground since: one of them is its home, by what its land detector makes of touching it.
        recent: true states of the last 3 s, with their times.
        server: whether the server runs.
        server_s: since when.
        stalled_until_s: until when it stands still.
        taken_before_s: when one of them had acted before that.
        taken_s: when a pilot, a station or a restart acted last.
        troubled: whether the link, a sensor or the battery is not as it should be.
        trouble_s: when something went wrong, or right, last.
        trouble_before_s: when it did before that.
        sent_s: times of the messages that were sent in the last second.
        setpoint: the last setpoint.
        setpoint_s: its time.
        before: the one before, with its time in before_s.
        shut_down_s: when the server was asked to end; infinite if it was not.
        path_enu_m: the planned path that is shown; empty for none.
        path_s: since when.
        rebooted_s: when the autopilot restarted last.
        mode_s: since when the vehicle is in its mode.
        hit_s: when it hit an obstacle first; infinite if it has not.
        asked_s: when a client asked for anything last.
        served_s: when a service was called last.
        items: latitude and longitude (1e7 degrees) of the mission that the server sent last.
        stored_for: the request of the goal that this mission is of.
        item_speed_m_s: the speed that this mission asks for first; infinite if none.
        answered_s: when a service was answered last.
        fleet: the views of all vehicles that share traffic, in order; empty for none.
        waits_for: the vehicle that it waits for by its server's picture.
        circled_s: since when it has been in a circle of vehicles that wait for each other while all
            their servers run; infinite if it is in none.
        circle_seen_s: when it was in one last.
        target_enu_m: where the target truly was last that it follows, or None.
        target_s: the time of that.
        target_m_s: how fast the target was then; infinite while that is not known.
        mark_enu_m: where the mark truly was when it was seen last.
        mark_s: the time of that.
        lie: the lie that somebody sends again and again with its ids; empty for none.
        lie_period_s: the time between two of these.
        denied_s: since when these have contradicted the vehicle's own reports without a break;
            infinite while they do not.
        misreports: what its server reports falsely to others; empty for nothing.
        misreported: whether it ever did.
        armings: how often the server has sent that the motors be started.
        payload_ends: how often each request to gimbal or camera was answered, by its number.
        steered_s: when the last velocity command was or will be sent.
        met: other aircraft by their numbers, and the time of each.
        led_s: since when setpoints lead it without a pause of a second; infinite while they do not.
        areas: of the fence that was sent to it last.
        released: the true state some seconds after that; None before.
    """

    craft: Craft
    config: ServerConfig
    posts: tuple[Post, ...] = ()
    wind_m_s: float = 0.0
    gust_m_s: float = 0.0
    goals: dict[str, Goal] = field(default_factory=dict)
    active: Goal | None = None
    last: Goal | None = None
    truth: Truth = UNSEEN
    homes_enu_m: tuple[tuple[float, float], ...] = ((0.0, 0.0),)
    moved_homes_enu_m: tuple[tuple[float, float], ...] = ()
    homes_up_m: tuple[float, ...] = (0.0,)
    set_s: float = -math.inf
    recent: deque[tuple[float, Truth]] = field(default_factory=deque)
    server: bool = False
    server_s: float = math.inf
    stalled_until_s: float = -math.inf
    taken_s: float = -math.inf
    taken_before_s: float = -math.inf
    troubled: set[str] = field(default_factory=set)
    trouble_s: float = -math.inf
    trouble_before_s: float = -math.inf
    sent_s: deque[float] = field(default_factory=deque)
    setpoint: Message | None = None
    setpoint_s: float = -math.inf
    before: Message | None = None
    before_s: float = -math.inf
    mode_s: float = -math.inf
    hit_s: float = math.inf
    asked_s: float = -math.inf
    served_s: float = -math.inf
    answered_s: float = -math.inf
    shut_down_s: float = math.inf
    items: dict[int, tuple[int, int]] = field(default_factory=dict)
    stored_for: Request | None = None
    item_speed_m_s: float = math.inf
    path_enu_m: tuple[Vector3, ...] = ()
    path_s: float = -math.inf
    rebooted_s: float = -math.inf
    fleet: Sequence[View] = ()
    waits_for: int = NOBODY
    circled_s: float = math.inf
    circle_seen_s: float = -math.inf
    target_enu_m: tuple[float, float, float] | None = None
    target_s: float = -math.inf
    target_m_s: float = math.inf
    mark_enu_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mark_s: float = -math.inf
    lie: str = ""
    lie_period_s: float = 0.0
    denied_s: float = math.inf
    misreports: str = ""
    misreported: bool = False
    armings: int = 0
    payload_ends: dict[int, int] = field(default_factory=dict)
    steered_s: float = -math.inf
    released: Truth | None = None
    met: dict[int, tuple[float, Met]] = field(default_factory=dict)
    led_s: float = math.inf
    areas: list[dict[str, Any]] = field(default_factory=list)

    def see(self, truth: Truth, now_s: float) -> None:
        """Keep a true state."""
        self.truth = truth
        if self.released is None and now_s > self.steered_s + _RELEASED_S:
            self.released = truth
        self.recent.append((now_s, truth))
        while self.recent[0][0] < now_s - 3.0:
            self.recent.popleft()

    def home_away_m(self, place_enu_m: Sequence[float]) -> float:
        """Return how far a place is from home, level."""
        return min(math.dist(home, place_enu_m[:2]) for home in self.homes_enu_m)

    @property
    def copter(self) -> bool:
        """Whether it is a multicopter."""
        return self.craft.kind == "copter"

    @property
    def hovers(self) -> bool:
        """Whether it can stand still."""
        return self.craft.kind != "plane"

    @property
    def speed_m_s(self) -> float:
        """True speed."""
        return math.hypot(*self.truth.velocity_enu_m_s)

    @property
    def flown(self) -> Goal:
        """The goal that is flown, or one that never was."""
        return self.active or NO_GOAL

    @property
    def left_s(self) -> float:
        """When the last goal ended, or the server began."""
        ended_s = -math.inf if self.last is None else self.last.ended_s
        return max(ended_s if math.isfinite(ended_s) else -math.inf, self.server_s)

    @property
    def waited_for(self) -> View | None:
        """The vehicle that its goal waits for, as its feedback says; None for none."""
        feedback = self.flown.feedback
        if feedback is None or feedback.status is not Status.WAITING_FOR_TRAFFIC:
            return None
        return None if self.waits_for == NOBODY else self.fleet[self.waits_for]

    def is_in_circle(self) -> bool:
        """Whether it waits for a vehicle that waits for it, perhaps by way of others."""
        at = self.waited_for
        for _ in self.fleet:
            if at is None or at is self:
                break
            at = at.waited_for
        return at is self

    def goal(self, goal_id: str) -> Goal:
        """Return an accepted goal, or one that never was."""
        return self.goals.get(goal_id, NO_GOAL)

    def calm(self, now_s: float, for_s: float) -> bool:
        """Whether nothing went wrong, and nobody took over, for a while."""
        return (
            not self.troubled
            and now_s - self.trouble_s > for_s
            and now_s - self.taken_s > for_s
            and now_s >= self.stalled_until_s + for_s
        )


class Course:
    """Keeps a view for each vehicle, entry by entry."""

    def __init__(self, scenario: Scenario) -> None:
        """Begin."""
        wind_m_s = math.hypot(*scenario.wind_ned_m_s)
        self.views = [
            View(
                craft,
                make_config({"arming": "auto", **craft.server}),
                scenario.posts,
                wind_m_s,
                scenario.gust_m_s,
            )
            for craft in scenario.crafts
        ]
        if scenario.shares_traffic:
            for view in self.views:
                view.fleet = self.views

    def take(self, entry: Entry) -> View:
        """Continue by an entry; return the view of its vehicle."""
        view = self.views[entry.craft]
        getattr(self, f"_{entry.kind}")(view, entry.value, entry.time_s)
        return view

    def _truth(self, view: View, truth: Truth, now_s: float) -> None:
        rises = view.truth.on_ground and not truth.on_ground and view.craft.autopilot == "px4"
        if truth.armed and not view.truth.armed:
            view.homes_enu_m = (truth.position_enu_m[:2], *view.moved_homes_enu_m)
        elif truth.armed and rises:
            view.homes_enu_m += (truth.position_enu_m[:2],)
        if truth.mode != view.truth.mode:
            view.mode_s = now_s
        # A rover or boat need not report whether it stands on the ground.
        reports = view.craft.kind in ("copter", "plane") or view.lie not in _OF_FLYING
        is_heard = reports and not view.craft.signed and view.lie in _DENIED
        is_denied = is_heard and _DENIED[view.lie](truth)
        view.denied_s = min(view.denied_s, now_s) if is_denied else math.inf
        if truth.collided:
            view.hit_s = min(view.hit_s, now_s)
        view.see(truth, now_s)
        view.flown.pass_by(truth.position_enu_m)
        if view.active is not None and view.troubled:
            view.active.disturbed = True
        if view.is_in_circle():
            view.circle_seen_s = now_s
        # While a server waits for an agreement, the vehicle waits for nobody for a moment.
        if now_s - view.circle_seen_s > _CIRCLE_GAP_S:
            view.circled_s = math.inf
        elif all(one.server and now_s >= one.stalled_until_s for one in view.fleet):
            view.circled_s = min(view.circled_s, now_s)
        else:
            view.circled_s = now_s

    def _asked(self, view: View, asked: Asked, now_s: float) -> None:
        view.asked_s = now_s
        if asked.goal_id:
            goal = view.goals[asked.goal_id] = Goal(asked.goal_id, asked.request, now_s)
            goal.begun = view.truth
            goal.disturbed = bool(view.troubled) or now_s - view.taken_s < 3.0
            if view.active is not None:
                view.last = view.active
            view.active = goal

    def _sent(self, view: View, message: Message, now_s: float) -> None:
        view.sent_s.append(now_s)
        while view.sent_s[0] < now_s - 1.0:
            view.sent_s.popleft()
        kind = message.get_type()
        if view.active is not None:
            view.active.stored |= kind == "MISSION_COUNT"
            view.active.cleared |= kind == "MISSION_CLEAR_ALL"
        if kind in COMMANDS and message.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            view.armings += message.param1 == 1.0
        if kind == "MISSION_COUNT" and message.mission_type == 0:
            view.items, view.item_speed_m_s = {}, math.inf
            view.stored_for = view.flown.request
        elif kind == "MISSION_ITEM_INT" and message.mission_type == 0:
            if message.command == mavlink.MAV_CMD_DO_CHANGE_SPEED and math.isinf(
                view.item_speed_m_s
            ):
                view.item_speed_m_s = message.param2
            view.items[message.seq] = (message.x, message.y)
        elif kind in SETPOINTS:
            view.before, view.before_s = view.setpoint, view.setpoint_s
            if now_s - view.setpoint_s > 1.0:
                view.led_s = now_s
            view.setpoint, view.setpoint_s = message, now_s

    def _output(self, view: View, output: Any, now_s: float) -> None:
        if isinstance(output, GoalFinished):
            goal = view.goals.get(output.goal_id)
            if goal is not None:
                goal.ends.append(output)
                goal.ended_s = min(goal.ended_s, now_s)
                if view.active is goal:
                    view.last, view.active = goal, None
        elif isinstance(output, GoalFeedback):
            goal = view.goals.get(output.goal_id)
            if goal is not None:
                goal.feedback, goal.feedback_s = output, now_s
                goal.paused |= output.status is Status.PAUSED
        elif isinstance(output, GoalHappened):
            goal = view.goals.get(output.goal_id)
            if goal is not None:
                goal.happened.append(output.event)
        elif isinstance(output, ServiceDone):
            view.answered_s = now_s
        elif isinstance(output, PlanChanged):
            view.path_enu_m, view.path_s = output.path_enu_m, now_s

    def _payload(self, view: View, value: PayloadAsked | PayloadEnded, now_s: float) -> None:
        if isinstance(value, PayloadEnded):
            view.payload_ends[value.number] = view.payload_ends.get(value.number, 0) + 1

    def _happening(self, view: View, event: Event, now_s: float) -> None:
        what, goal = event.what, view.active
        if view.craft.signed and not event.how.get("signed", True):
            return
        if goal is not None and (what in _TAKERS | _TROUBLE | _STORING):
            goal.disturbed = True
        if what in _TAKERS:
            view.taken_before_s, view.taken_s = view.taken_s, now_s
        if what in _TROUBLE:
            view.trouble_before_s, view.trouble_s = view.trouble_s, now_s
            self._trouble(view, what, event.how, now_s)
        self._set(view, event, now_s)
        if what == "mended":
            if view.troubled & _OVER.keys():
                view.trouble_s = now_s
            view.troubled -= _OVER.keys()
        elif what in ("serve", "steer", "shut_down"):
            self._call(view, event, now_s)
        elif goal is not None:
            _note_client(goal, what, now_s)

    @staticmethod
    def _call(view: View, event: Event, now_s: float) -> None:
        """Note what is asked for beside goals."""
        if event.what == "serve":
            view.served_s = now_s
        elif event.what == "steer":
            view.steered_s, view.released = now_s + event.how["seconds"], None
        else:
            view.shut_down_s = now_s

    @staticmethod
    def _set(view: View, event: Event, now_s: float) -> None:
        """Note what a ground station sets."""
        how = event.how
        if event.what == "station_home":
            north, east, up = how["offset"]
            view.moved_homes_enu_m += ((east, north),)
            view.homes_up_m += (up,)
            view.homes_enu_m += ((east, north),)
        elif event.what == "station_fence":
            view.areas = how["areas"]
        elif event.what == "station_param":
            onboard = {**view.craft.onboard, how["name"]: how["value"]}
            view.craft = replace(view.craft, onboard=onboard)
        else:
            return
        view.set_s = now_s
        if view.active is not None:
            view.active.disturbed = True

    @staticmethod
    def _trouble(view: View, what: str, how: dict[str, Any], now_s: float) -> None:
        if what == "stall":
            view.stalled_until_s = max(view.stalled_until_s, now_s + how["seconds"])
            return
        if what == "reboot":
            view.rebooted_s = now_s
        elif what == "lie":
            view.lie, view.lie_period_s = "", how.get("period", 0.0)
            if view.lie_period_s:
                view.lie = how["claim"]
        elif what == "misreport":
            view.misreports = how.get("claim", "")
            view.misreported = True
        if what in ("noise", "station_arm", "reboot", "kill", "pilot_throttle"):
            return
        if what in _OVER and _OVER[what](how):
            view.troubled.discard(what)
        else:
            view.troubled.add(what)

    def _waits(self, view: View, whom: int, now_s: float) -> None:
        view.waits_for = whom

    def _size(self, view: View, size: tuple[str, int], now_s: float) -> None:
        """Nothing to keep."""

    def _target(self, view: View, place: tuple[float, float, float], now_s: float) -> None:
        before, before_s = view.target_enu_m, view.target_s
        view.target_m_s = math.inf
        if before is not None and 0.0 < now_s - before_s < 1.0:
            view.target_m_s = math.dist(before, place) / (now_s - before_s)
        view.target_enu_m, view.target_s = place, now_s

    def _mark(self, view: View, place: tuple[float, float, float], now_s: float) -> None:
        view.mark_enu_m, view.mark_s = place, now_s

    def _intruder(self, view: View, met: Met, now_s: float) -> None:
        view.met[met.number] = now_s, met

    def _recorded(self, view: View, ends: dict[str, tuple[str, str]], now_s: float) -> None:
        """Nothing to keep."""

    def _server(self, view: View, what: str, now_s: float) -> None:
        view.server = what == "started"
        if view.server:
            view.server_s = now_s
            view.shut_down_s = math.inf
        view.setpoint = view.before = None
        view.path_enu_m = ()
        view.active = view.last = None
        view.goals = {}
        view.stalled_until_s = -math.inf
        view.waits_for = NOBODY
        if what == "killed":
            view.taken_s = now_s


def _note_client(goal: Goal, what: str, now_s: float) -> None:
    if what == "cancel":
        goal.cancel_s = min(goal.cancel_s, now_s)
    elif what == "pause":
        goal.paused_s = now_s
    elif what == "resume":
        goal.paused_s = math.inf


def speed_of(message: Message) -> float:
    """The speed that a setpoint asks for; 0 where its mask ignores velocity."""
    if message.type_mask & mavlink.POSITION_TARGET_TYPEMASK_VX_IGNORE:
        return 0.0
    return math.hypot(message.vx, message.vy, message.vz)
