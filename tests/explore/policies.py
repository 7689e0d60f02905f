"""The policies: what never, always or in time happens, whoever does what and whatever goes wrong.

Each is a function; its docstring says it. "Ours" is a promise of docs/navigate.md;
other sources are named.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from mavlink_vehicle.codec import Message, mavlink
from navigation_bridge.goals.goal import (
    GoalFeedback,
    GoalFinished,
    GoalHappened,
    LogLine,
    PlanChanged,
    ServiceDone,
)
from navigation_bridge.goals.lifecycle import GoalState
from navigation_bridge.goals.requests import (
    ActKind,
    FollowRequest,
    LandRequest,
    NavigateRequest,
    OrbitRequest,
    ReturnRequest,
    TakeoffRequest,
    TrajectoryRequest,
    VelocityRequest,
    WaypointRequest,
    WaypointsRequest,
)
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.flying.target_landing import OFF_MAX_M
from navigation_core.tasks.progress import FollowState, Status
from navigation_core.trajectories.timed_point import TimedPoint
from tests.explore.course import COMMANDS, NO_GOAL, SETPOINTS, Goal, View, speed_of
from tests.explore.log import Asked, Entry, PayloadAsked, PayloadEnded, Truth
from tests.explore.passages import has_passage
from tests.explore.temporal import (
    Select,
    always,
    happens,
    never,
    of_kind,
    output,
    policies,
    sent,
    within,
)

__all__ = ["ON_TRIAL", "POLICIES"]

OURS = "ours"
ACTIONS = "design.ros2.org, Actions"
PARAMETERS = "docs/parameters.md"
SETPOINT = "SET_POSITION_TARGET_LOCAL_NED"
# A HEARTBEAT shows the mode, once a second; some may be lost.
_ANSWER_S = 4.0
# On a good link, knowledge of a vehicle is at most this old.
_REPORTED_S = 0.5
_HULL_M = 0.5
# To the posts on both sides of a path that nobody misses.
_WIDE_M = 2.5
# A vehicle that has been on for less shows a restart neither by its time since boot nor otherwise.
_BOOTED_S = 3.0
# Of latitude; and the radius of a plane's circle, which it flies twice as wide at most.
_DEGREE_M, _PLANE_CIRCLE_M = 111_200.0, 60.0
# A target that is lost is looked for above 1 m; below, the vehicle lands, and stands for a while.
_UNSEEN_S = 11.0
# Another aircraft counts until this long after its last report; then a goal is where it was before.
_FORGOTTEN_S = 45.0
# A landing takes longer than this.
_LANDS_S = 4.0
_CONTROL = {"ardupilot": "GUIDED", "px4": "OFFBOARD"}
_END = output(GoalFinished)
# A setpoint that is slower leads nowhere.
_STANDS_M_S = 0.02
_FEEDBACK = output(GoalFeedback)
_SETPOINTS = sent(*SETPOINTS)
# The sensors of all vehicles see farther than this.
_SEEN_M = 5.0
_TRUTH = of_kind("truth")


def _ended(code: OutcomeCode) -> Select:
    def pick(output: Any) -> Any:
        return output if isinstance(output, GoalFinished) and output.code is code else None

    return Select("output", pick, (GoalFinished.__name__,))


def _command(*numbers: int) -> Select:
    def pick(message: Message) -> Any:
        return message if message.get_type() in COMMANDS and message.command in numbers else None

    return Select("sent", pick, tuple(COMMANDS))


def _active(what: str) -> Callable[[Entry, View], str | None]:
    """Return the active goal's id when something happens to it."""

    def begins(entry: Entry, view: View) -> str | None:
        return view.active.goal_id if view.active and happens(what, entry) else None

    return begins


_SUCCESS = _ended(OutcomeCode.SUCCESS)
_TAKING = (
    *(mavlink.MAV_CMD_DO_SET_MODE, mavlink.MAV_CMD_COMPONENT_ARM_DISARM),
    *(mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_DO_REPOSITION, mavlink.MAV_CMD_MISSION_START),
)
_SET_MODE = _command(mavlink.MAV_CMD_DO_SET_MODE)
_ARM = _command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM)


def _finite(*values: float) -> bool:
    return all(math.isfinite(value) for value in values)


def _undisturbed(end: GoalFinished, view: View, now_s: float) -> bool:
    """Whether a goal that ends was left alone by everybody but clients."""
    return not view.goal(end.goal_id).disturbed and view.calm(now_s, 5.0)


def _ours(view: View, now_s: float) -> bool:
    """Whether the server flies a goal, and nothing is or was wrong."""
    return not view.flown.disturbed and view.calm(now_s, 10.0)


def _stands(view: View, below_m_s: float) -> bool:
    """Whether it stands, as well as gusts let it."""
    return view.speed_m_s < below_m_s + 1.5 * view.gust_m_s


def _avoids(view: View) -> bool:
    # Commands keep clear of what is sensed, without being asked to.
    steered = bool(view.posts) and isinstance(view.flown.request, VelocityRequest)
    return steered or _avoids_any(view.flown)


def _gives_way(view: View) -> bool:
    """Whether its goal may lead elsewhere than straight to its target."""
    return _avoids(view) or bool(view.fleet) or view.craft.sees_traffic


def _meets(view: View, now_s: float) -> bool:
    """Whether another aircraft is known, which a goal gives way to, paused or not."""
    return any(now_s - seen_s < _FORGOTTEN_S for seen_s, _ in view.met.values())


def _begun_too_near(goal: Goal, last: Goal | None, now_s: float) -> bool:
    """Whether a goal that avoids nothing had left it no room to stop in, just now."""
    if goal.begun is None or now_s - goal.accepted_s > 3.0 or (last and _avoids_any(last)):
        return False
    speed_m_s = math.hypot(*goal.begun.velocity_enu_m_s)
    return goal.begun.clearance_m < 0.5 * speed_m_s + speed_m_s**2 / 4.0


def _serving(view: View, now_s: float) -> bool:
    return now_s - view.served_s < 60.0


def _arming(view: View) -> str:
    return str(view.craft.server.get("arming", "auto"))


def _speed_max_m_s(view: View) -> float:
    return float(view.craft.server.get("speed_max_m_s", 10.0))


def _from_line_m(begin: Sequence[float], end: Sequence[float], place: Sequence[float]) -> float:
    """Return how far a place is from the line between two others."""
    along, offset = np.subtract(end, begin), np.subtract(place, begin)
    share = np.clip(offset @ along / max(float(along @ along), 1e-9), 0.0, 1.0)
    return float(np.hypot(*(offset - share * along)))


def _target(request: Any) -> tuple[float, float, float] | None:
    if isinstance(request, NavigateRequest) and request.frame_id in ("map", ""):
        return request.position
    if isinstance(request, WaypointsRequest):
        return request.waypoints[-1].position
    return None


# --- goals -----------------------------------------------------------------------------------


@always(_END, ACTIONS)
def a_goal_ends_once(end: GoalFinished, view: View, now_s: float) -> bool:
    """An accepted goal has exactly one result."""
    return len(view.goal(end.goal_id).ends) == 1


@within(lambda view: 1400.0, _active("mended"), OURS)
def a_goal_ends(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """Every accepted goal ends when all is well again."""
    return goal_id not in view.goals or bool(view.goals[goal_id].ends)


def _troubled_since(view: View, begun_s: float) -> bool:
    return bool(view.troubled) or max(view.trouble_s, view.stalled_until_s) > begun_s


@within(lambda view: view.config.bridge.goto.cancel_timeout_s + 25.0, _active("cancel"), OURS)
def a_cancel_ends_the_goal(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A cancelled goal ends within its timeouts, on a link without faults."""
    return a_goal_ends(view, goal_id, begun_s, now_s) or _troubled_since(view, begun_s)


@within(lambda view: view.config.bridge.goto.cancel_timeout_s + 30.0, _active("shut_down"), OURS)
def a_shut_down_ends_the_goal(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A server that is asked to end ends its goal first."""
    return a_goal_ends(view, goal_id, begun_s, now_s) or _troubled_since(view, begun_s)


def _ends_in_control(entry: Entry, view: View) -> str | None:
    if not isinstance(entry.value, GoalFinished) or not view.truth.armed:
        return None
    in_control = view.truth.mode == _CONTROL[view.craft.autopilot]
    return entry.value.goal_id if in_control else None


@within(lambda view: 0.2, _ends_in_control, "ArduCopter GUID_TIMEOUT, PX4 COM_OF_LOSS_T")
def nothing_is_left_with_a_velocity(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """The last setpoint of a goal that ends has no velocity, which would be followed on."""
    disturbed = view.taken_s > begun_s - 3.0 or view.stalled_until_s > begun_s - 1.0
    message, goal = view.setpoint, view.goals.get(goal_id)
    if disturbed or view.active is not None or message is None or goal is None:
        return True
    if view.setpoint_s < goal.accepted_s or view.setpoint_s < begun_s - 3.0:
        return True
    return speed_of(message) < _STANDS_M_S


@always(of_kind("asked"), OURS)
def a_rejection_says_why(asked: Asked, view: View, now_s: float) -> bool:
    """A rejected goal has a code and a sentence."""
    rejection = asked.rejection
    return rejection is None or (
        rejection.code is not OutcomeCode.SUCCESS and rejection.message.endswith(".")
    )


@always(_END, OURS)
def an_end_says_why(end: GoalFinished, view: View, now_s: float) -> bool:
    """A result has its code and a sentence."""
    return end.message.startswith(f"{end.code.value}: ") and end.message.endswith(".")


@always(_END, ACTIONS)
def state_and_code_agree(end: GoalFinished, view: View, now_s: float) -> bool:
    """SUCCESS is SUCCEEDED, CANCELED is CANCELED, all else is ABORTED."""
    states = {
        OutcomeCode.SUCCESS: GoalState.SUCCEEDED,
        OutcomeCode.CANCELED: GoalState.CANCELED,
    }
    return end.state is states.get(end.code, GoalState.ABORTED)


@always(_ended(OutcomeCode.CANCELED), ACTIONS)
def canceled_only_when_asked(end: GoalFinished, view: View, now_s: float) -> bool:
    """CANCELED needs the cancel of a client or a ground station."""
    goal = view.goal(end.goal_id)
    return math.isfinite(goal.cancel_s) or goal.disturbed


@never(_ended(OutcomeCode.INTERNAL_ERROR), OURS)
def an_internal_error(end: GoalFinished, view: View, now_s: float) -> bool:
    """INTERNAL_ERROR is a defect."""
    return True


@always(_END, OURS)
def elapsed_is_true(end: GoalFinished, view: View, now_s: float) -> bool:
    """A result's elapsed time is the time since acceptance."""
    return abs(now_s - view.goal(end.goal_id).accepted_s - end.elapsed_s) < 0.2


@always(_ended(OutcomeCode.PREEMPTED), ACTIONS)
def replaced_by_somebody(end: GoalFinished, view: View, now_s: float) -> bool:
    """PREEMPTED needs a newer goal or a service."""
    return now_s - max(view.asked_s, view.served_s) < 0.1


@always(_SUCCESS, OURS)
def success_is_at_the_target(end: GoalFinished, view: View, now_s: float) -> bool:
    """SUCCESS is near the target, by ground truth."""
    target = _target(view.goal(end.goal_id).request)
    # An estimator that had lost its GPS takes a minute to come back.
    if target is None or not _undisturbed(end, view, now_s) or not view.calm(now_s, 60.0):
        return True
    away_m = math.dist(target[:2], view.truth.position_enu_m[:2])
    return away_m < (3.0 if view.hovers else 150.0)


@always(_SUCCESS, "docs/parameters.md, arrival_radius_m")
def arrived_is_within_the_radius(end: GoalFinished, view: View, now_s: float) -> bool:
    """A Navigate goal of a copter that succeeds reports an error within `arrival_radius_m`."""
    navigates = isinstance(view.goal(end.goal_id).request, NavigateRequest)
    if not navigates or not view.copter or end.final_error_m is None:
        return True
    return end.final_error_m <= view.config.bridge.goto.arrival_radius_m + 0.01


@always(_SUCCESS, OURS)
def success_stands(end: GoalFinished, view: View, now_s: float) -> bool:
    """A vehicle that can stand still stands when it reports SUCCESS, by ground truth."""
    return not view.hovers or not _undisturbed(end, view, now_s) or _stands(view, 0.6)


@always(_ended(OutcomeCode.CANCELED), OURS)
def canceled_stands(end: GoalFinished, view: View, now_s: float) -> bool:
    """CANCELED means below 0.3 m/s by ground truth; gusts push, and a brake rolls back a little."""
    goal = view.goal(end.goal_id)
    if not view.hovers or not view.calm(now_s, 15.0):
        return True
    if isinstance(goal.request, LandRequest | ReturnRequest | TakeoffRequest):
        return True
    timed_out = now_s - goal.cancel_s >= view.config.bridge.goto.cancel_timeout_s
    return timed_out or _stands(view, 0.3 if view.copter else 0.45)


@always(_SUCCESS, OURS)
def landed_is_landed(end: GoalFinished, view: View, now_s: float) -> bool:
    """A Land that succeeds ends on the ground, disarmed."""
    if not isinstance(view.goal(end.goal_id).request, LandRequest):
        return True
    return not _undisturbed(end, view, now_s) or (view.truth.on_ground and not view.truth.armed)


@always(_SUCCESS, OURS)
def returned_is_home(end: GoalFinished, view: View, now_s: float) -> bool:
    """A ReturnToLaunch that succeeds ends near home, where the vehicle was armed."""
    if not isinstance(view.goal(end.goal_id).request, ReturnRequest):
        return True
    away_m = view.home_away_m(view.truth.position_enu_m)
    return not _undisturbed(end, view, now_s) or away_m < (6.0 if view.hovers else 200.0)


@always(_SUCCESS, OURS)
def taken_off_is_up(end: GoalFinished, view: View, now_s: float) -> bool:
    """A Takeoff that succeeds ends in the air."""
    goal = view.goal(end.goal_id)
    if goal.begun is None or not isinstance(goal.request, TakeoffRequest):
        return True
    # Home may be above the ground, after a restart in the air.
    rise_m = view.truth.position_enu_m[2] - goal.begun.position_enu_m[2]
    is_up = not view.truth.on_ground and rise_m > 0.8
    return not _undisturbed(end, view, now_s) or is_up


def _route_length(end: GoalFinished, view: View) -> int | None:
    request = view.goal(end.goal_id).request
    if not isinstance(request, WaypointsRequest):
        return None
    return len(request.waypoints) * max(1, request.laps)


@always(_END, OURS)
def waypoints_are_counted(end: GoalFinished, view: View, now_s: float) -> bool:
    """No more waypoints are reached than were asked for."""
    length = _route_length(end, view)
    return length is None or 0 <= end.waypoints_reached <= length


@always(_SUCCESS, OURS)
def a_whole_route_is_reached(end: GoalFinished, view: View, now_s: float) -> bool:
    """A route that succeeds has reached all its waypoints."""
    length = _route_length(end, view)
    return length is None or end.waypoints_reached == length


@always(_END, "docs/navigate.md, codes")
def a_restart_is_named(end: GoalFinished, view: View, now_s: float) -> bool:
    """A goal that ends because its autopilot has restarted says so."""
    goal, since_s = view.goal(end.goal_id), now_s - view.rebooted_s
    alone = view.trouble_s == view.taken_s == view.rebooted_s and not view.troubled
    if not alone or not 0.3 < since_s < 8.0 or view.rebooted_s < 10.0:
        return True
    asked = math.isfinite(min(goal.cancel_s, view.shut_down_s)) or goal.accepted_s > view.rebooted_s
    asked = asked or max(view.served_s, view.asked_s) > view.rebooted_s
    return asked or end.code is OutcomeCode.VEHICLE_REBOOTED


@always(output(GoalHappened), OURS)
def events_in_order(event: GoalHappened, view: View, now_s: float) -> bool:
    """ACCEPTED comes first and ENDED last, each once."""
    if event.goal_id not in view.goals:
        return True
    happened = view.goals[event.goal_id].happened
    ends = happened.count("ENDED") == (event.event == "ENDED")
    return happened[0] == "ACCEPTED" and happened.count("ACCEPTED") == 1 and ends


_BAD_NUMBERS = frozenset(
    {
        *(OutcomeCode.INVALID_NUMBER, OutcomeCode.INVALID_WAYPOINTS),
        *(OutcomeCode.INVALID_ORIENTATION, OutcomeCode.NEGATIVE_SPEED),
    }
)


def _numbers(request: NavigateRequest) -> tuple[float, ...]:
    return (*request.position, *request.orientation_xyzw, request.max_speed_m_s)


@never(of_kind("asked"), "docs/navigate.md, codes")
def good_numbers_rejected(asked: Asked, view: View, now_s: float) -> bool:
    """A goal in the map frame with finite numbers is not rejected because of its numbers."""
    request, rejection = asked.request, asked.rejection
    if rejection is None or rejection.code not in _BAD_NUMBERS:
        return False
    if isinstance(request, NavigateRequest):
        return request.frame_id in ("", "map") and _finite(*_numbers(request))
    if not isinstance(request, WaypointsRequest):
        return False
    acts = [act for waypoint in request.waypoints for act in waypoint.acts]
    rate_rad_s = abs(request.yaw_rate_rad_s)
    most_rad_s = 0.0 if request.by_mission else view.config.bridge.goto.limits.yaw_rate_rad_s
    return _finite(*(act.duration_s for act in acts)) and rate_rad_s <= most_rad_s


@always(of_kind("asked"), "docs/navigate.md, codes")
def bad_numbers_are_rejected(asked: Asked, view: View, now_s: float) -> bool:
    """A Navigate goal with NaN or infinity is rejected with INVALID_NUMBER."""
    request, rejection = asked.request, asked.rejection
    if not isinstance(request, NavigateRequest) or _finite(*_numbers(request)):
        return True
    codes = (OutcomeCode.INVALID_NUMBER, OutcomeCode.NO_VEHICLE, OutcomeCode.SHUTTING_DOWN)
    return rejection is not None and rejection.code in codes


@always(of_kind("asked"), "docs/navigate.md, kinds of vehicles")
def takeoffs_are_for_what_flies(asked: Asked, view: View, now_s: float) -> bool:
    """Only a vehicle that flies gets a Takeoff accepted, and no copter is rejected as unable to."""
    if not isinstance(asked.request, TakeoffRequest):
        return True
    drives = view.craft.kind in ("rover", "boat")
    unable = asked.rejection is not None and (
        asked.rejection.code is OutcomeCode.UNSUPPORTED_VEHICLE
    )
    return not asked.goal_id if drives else not unable or not view.copter


_MISHAPS = frozenset(
    {
        *(OutcomeCode.TIMEOUT, OutcomeCode.MISSION_REFUSED, OutcomeCode.MODE_REFUSED),
        *(OutcomeCode.ARMING_REFUSED, OutcomeCode.LINK_LOST, OutcomeCode.NO_POSITION),
        *(OutcomeCode.TAKEOFF_REFUSED, OutcomeCode.SERVER_LATE),
        *(OutcomeCode.MISSION_CHANGED, OutcomeCode.VEHICLE_REBOOTED, OutcomeCode.DISARMED),
        *(OutcomeCode.PILOT_OVERRIDE, OutcomeCode.NO_OBSTACLE_DATA, OutcomeCode.WAYPOINT_MISSED),
    }
)


@never(_END, OURS)
def a_mishap_of_a_first_goal(end: GoalFinished, view: View, now_s: float) -> bool:
    """The first goal of a server does not fail when nothing whatever is wrong."""
    craft, goal = view.craft, view.goal(end.goal_id)
    alone = view.taken_s == view.trouble_s == view.served_s == -math.inf
    alone = alone and view.stalled_until_s == -math.inf and len(view.goals) == 1
    alone = alone and math.isfinite(goal.accepted_s) and goal.cancel_s == goal.paused_s == math.inf
    usual = not craft.onboard and craft.battery == 1.0 and _arming(view) == "auto"
    # Gusts may keep it from settling.
    timeless = bool(craft.server) or view.gust_m_s > 0.0
    usual = usual and not (timeless and end.code is OutcomeCode.TIMEOUT)
    # A plane that starts with the wind behind it may never get fast enough on its wheels.
    usual = usual and (view.hovers or view.wind_m_s < 2.0)
    # An obstacle on the path of a vehicle that avoids nothing is hit.
    usual = usual and view.hit_s == math.inf
    return alone and usual and not _avoids_any(goal) and end.code in _MISHAPS


@never(_ended(OutcomeCode.NO_PATH), "docs/obstacles.md")
def a_passage_not_found(end: GoalFinished, view: View, now_s: float) -> bool:
    """A copter that avoids obstacles finds a path to its target where a wide one exists."""
    goal, target = view.goal(end.goal_id), _target(view.goal(end.goal_id).request)
    usual = not view.craft.onboard and not view.craft.server and view.copter
    if not usual or target is None or goal.begun is None or not _undisturbed(end, view, now_s):
        return False
    return has_passage(view.posts, goal.begun.position_enu_m, target, _WIDE_M)


def _avoids_any(goal: Any) -> bool:
    return bool(getattr(goal.request, "avoid_obstacles", False))


def _led(view: View) -> bool:
    """Whether the active goal leads a vehicle that can stand still by setpoints."""
    request = view.flown.request
    is_led = isinstance(request, NavigateRequest | WaypointsRequest)
    return is_led and view.hovers and not view.flown.by_mission


@within(lambda view: 1.5, _active("cancel"), OURS)
def a_cancel_is_reported(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A goal that is cancelled says so at once, or has ended."""
    goal = view.goals.get(goal_id)
    if goal is None or goal.ends or goal.disturbed or not view.calm(now_s, 3.0):
        return True
    return goal.feedback is not None and goal.feedback.status is Status.CANCELLING


def _held(entry: Entry, view: View) -> str | None:
    holds = happens("serve", entry) and entry.value.how["service"] == "hold"
    return view.flown.goal_id if holds and view.active else None


@within(lambda view: 1.0, _held, OURS)
def a_hold_ends_the_goal(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """The hold service ends the goal at once."""
    return a_goal_ends(view, goal_id, begun_s, now_s) or view.stalled_until_s > begun_s - 1.0


@always(_ended(OutcomeCode.PILOT_OVERRIDE), "docs/navigate.md, codes")
def overridden_by_somebody(end: GoalFinished, view: View, now_s: float) -> bool:
    """PILOT_OVERRIDE needs a pilot or a ground station; a restart and a service are none."""
    alone = view.rebooted_s == view.taken_s and view.taken_s - view.taken_before_s > 3.0
    if not view.troubled and alone and now_s - view.taken_s < 15.0:
        # Just after its first start the time since boot hardly goes back.
        return view.trouble_s > view.rebooted_s or view.rebooted_s < _BOOTED_S
    if now_s - view.served_s < 2.0 and view.taken_s < view.served_s - 5.0:
        return "silence" in view.troubled
    goal = view.goal(end.goal_id)
    return goal.disturbed or not view.calm(now_s, 30.0)


@within(lambda view: 3.0, lambda e, v: _active("shut_down")(e, v) if _led(v) else None, OURS)
def a_shut_down_is_reported(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A goal of a server that is asked to end stops the vehicle, or has ended."""
    return bool(a_cancel_is_reported(view, goal_id, begun_s, now_s))


_LEFT_ALONE = frozenset(
    {
        *(OutcomeCode.PILOT_OVERRIDE, OutcomeCode.LINK_LOST, OutcomeCode.VEHICLE_REBOOTED),
        *(OutcomeCode.DISARMED, OutcomeCode.INTERNAL_ERROR),
    }
)


def _stopped_by_us(entry: Entry, view: View) -> str | None:
    end = _END(entry)
    if end is None or end.code in _LEFT_ALONE or "FAILSAFE" in end.code.value:
        return None
    ours = view.hovers and view.truth.armed and view.truth.mode == _CONTROL[view.craft.autopilot]
    return end.goal_id if ours and view.active is None and view.calm(entry.time_s, 5.0) else None


@within(lambda view: 0.6, _stopped_by_us, "ArduPilot GUID_TIMEOUT")
def the_last_setpoint_stands(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A vehicle under our control is not left with a velocity when its goal ends."""
    over = view.active is not None or view.asked_s >= begun_s or not view.server
    moves = view.setpoint is not None and speed_of(view.setpoint) > 0.05
    return over or not moves or view.mode_s > begun_s or not view.calm(now_s, 5.0)


def _replaces(entry: Entry, view: View) -> str | None:
    if entry.kind != "asked" or not entry.value.goal_id or view.last is None:
        return None
    return None if view.last.ends else view.last.goal_id


@within(lambda view: 0.5, _replaces, ACTIONS)
def a_replaced_goal_ends(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A goal that another one replaces has its result at once."""
    return a_goal_ends(view, goal_id, begun_s, now_s) or now_s < view.stalled_until_s + 1.0


@always(of_kind("asked"), "docs/parameters.md, on_new_goal")
def busy_rejects(asked: Asked, view: View, now_s: float) -> bool:
    """With `on_new_goal` reject nothing is accepted before the last goal has ended."""
    rejects = view.craft.server.get("on_new_goal") == "reject"
    return not (rejects and asked.goal_id and view.last is not None and not view.last.ends)


@always(of_kind("asked"), PARAMETERS)
def accepted_targets_are_in_the_volume(asked: Asked, view: View, now_s: float) -> bool:
    """No target outside of the flight volume is accepted."""
    target = _target(asked.request)
    if not asked.goal_id or target is None:
        return True
    volume = view.config.bridge.volume
    return math.hypot(*target[:2]) <= volume.radius_max_m + 1.0


@always(of_kind("asked"), OURS)
def accepted_goals_have_a_position(asked: Asked, view: View, now_s: float) -> bool:
    """No goal but a landing and a return is accepted before the vehicle's position is known."""
    # Whether it can return is known to its autopilot, which rejects the mode otherwise.
    by_itself = isinstance(asked.request, LandRequest | ReturnRequest)
    return not asked.goal_id or asked.located or by_itself


@never(of_kind("asked"), "docs/parameters.md, position_stale_s")
def a_goal_accepted_on_an_old_position(asked: Asked, view: View, now_s: float) -> bool:
    """No goal but a landing and a return is accepted while positions have ceased to arrive."""
    by_itself = isinstance(asked.request, LandRequest | ReturnRequest)
    if not asked.goal_id or by_itself or "unlocated" not in view.troubled:
        return False
    stale_s = view.config.bridge.goto.position_stale_s
    return now_s - max(view.trouble_s, view.server_s, view.stalled_until_s) > stale_s + 1.0


@never(_ended(OutcomeCode.NO_POSITION), OURS)
def an_old_jump_counts(end: GoalFinished, view: View, now_s: float) -> bool:
    """NO_POSITION is not due to what happened to the position a minute before the goal."""
    wrong = view.troubled - {"glitch", "battery", "wind", "blind"}
    since_s = max(view.trouble_s, view.taken_s, view.stalled_until_s)
    return not wrong and view.goal(end.goal_id).accepted_s - since_s > 60.0


@always(of_kind("asked"), "ArduPilot FENCE_RADIUS, PX4 GF_MAX_HOR_DIST")
def accepted_targets_are_in_the_fence(asked: Asked, view: View, now_s: float) -> bool:
    """No target outside of the vehicle's own fence is accepted once that is known."""
    target = _target(asked.request)
    if not asked.goal_id or target is None:
        return True
    known = now_s - max(view.server_s, view.set_s) > 20.0 and view.calm(now_s, 20.0)
    return not known or not _is_fenced_off(view, target, 2.0)


def _is_fenced_off(view: View, place_enu_m: Sequence[float], by_m: float) -> bool:
    """Whether a place is beyond the vehicle's own fence, by more than that."""
    onboard = view.craft.onboard
    radius_m = onboard.get("FENCE_RADIUS", 300.0) if onboard.get("FENCE_ENABLE") else math.inf
    radius_m = onboard.get("GF_MAX_HOR_DIST", radius_m)
    if view.home_away_m(place_enu_m) > radius_m + by_m:
        return True
    return any(_is_barred(area, place_enu_m[0], place_enu_m[1], by_m) for area in view.areas)


def _is_barred(area: dict[str, Any], east_m: float, north_m: float, by_m: float) -> bool:
    """Whether an area of a fence bars a place, by more than that; east and north of home."""
    if "corners" not in area:
        away_m = math.dist(area["centre"], (east_m, north_m)) - area["radius"]
        return bool(away_m > by_m) if area["inside"] else bool(-away_m > by_m)
    corners = [tuple(corner) for corner in area["corners"]]
    crossed, least_m = False, math.inf
    for (x, y), (a, b) in zip(corners, [*corners[1:], corners[0]], strict=True):
        least_m = min(least_m, _from_line_m((x, y), (a, b), (east_m, north_m)))
        if (y > north_m) != (b > north_m):
            crossed ^= east_m < x + (north_m - y) * (a - x) / (b - y)
    return crossed is not area["inside"] and least_m > by_m


TRAJECTORIES = "docs/programs.md, Trajectories of other planners"


def _trajectory(asked: Asked) -> tuple[TimedPoint, ...]:
    """Return the points of a trajectory that was accepted; none for anything else."""
    accepted = asked.goal_id and isinstance(asked.request, TrajectoryRequest)
    return asked.request.points if accepted else ()


@always(of_kind("asked"), TRAJECTORIES)
def accepted_trajectories_begin_here(asked: Asked, view: View, now_s: float) -> bool:
    """None that begins far from the vehicle is accepted."""
    points = _trajectory(asked)
    if not points or not view.calm(now_s, 20.0):
        return True
    away_m = math.dist(points[0].position_enu_m, view.truth.position_enu_m)
    return away_m <= view.config.bridge.trajectories.start_distance_m + 1.0


@always(of_kind("asked"), TRAJECTORIES)
def accepted_trajectories_stop_in_the_volume(asked: Asked, view: View, now_s: float) -> bool:
    """None is accepted whose last point, or the shortest stop after it, is outside."""
    points = _trajectory(asked)
    if not points:
        return True
    (x, y, _), (v_x, v_y, _) = points[-1].position_enu_m, points[-1].velocity_enu_m_s or (0, 0, 0)
    per_m_s = math.hypot(v_x, v_y) / (
        2.0 * view.config.bridge.goto.limits.acceleration_horizontal_m_s2
    )
    away_m = math.hypot(x + per_m_s * v_x, y + per_m_s * v_y)
    return away_m <= view.config.bridge.volume.radius_max_m + 0.1


@always(sent(SETPOINTS[0]), TRAJECTORIES)
def a_trajectory_has_no_jump(message: Message, view: View, now_s: float) -> bool:
    """Its setpoints move no farther than their speed leads, and are moved a little beside it."""
    before, since_s = view.before, now_s - view.before_s
    if before is None or not isinstance(view.flown.request, TrajectoryRequest):
        return True
    if _is_led(view) or not _ours(view, now_s) or not 0.01 < since_s < 0.3:
        return True
    if (message.type_mask | before.type_mask) & 0b001001 or now_s - view.flown.accepted_s < 1.0:
        return True
    places = [(each.x, each.y, each.z) for each in (message, before)]
    fastest_m_s = max(speed_of(message), speed_of(before))
    return math.dist(*places) <= 1.5 * since_s * fastest_m_s + 0.3


@always(_SUCCESS, "REP 105, base_link")
def relative_targets_are_relative(end: GoalFinished, view: View, now_s: float) -> bool:
    """A target in base_link is ahead and to the left as was asked, by ground truth."""
    goal = view.goal(end.goal_id)
    if not isinstance(goal.request, NavigateRequest) or goal.request.frame_id != "base_link":
        return True
    if goal.begun is None or not view.hovers or not _undisturbed(end, view, now_s):
        return True
    (ahead_m, left_m, _), yaw_rad = goal.request.position, goal.begun.yaw_enu_rad
    east_m, north_m, _ = goal.begun.position_enu_m
    target_enu_m = (
        east_m + ahead_m * math.cos(yaw_rad) - left_m * math.sin(yaw_rad),
        north_m + ahead_m * math.sin(yaw_rad) + left_m * math.cos(yaw_rad),
    )
    began_m_s = math.hypot(*goal.begun.velocity_enu_m_s)
    return math.dist(target_enu_m, view.truth.position_enu_m[:2]) < 3.0 + began_m_s


def _stay_s(waypoint: WaypointRequest) -> float:
    """The hold time and what the acts wait."""
    return waypoint.hold_time_s + sum(
        act.duration_s for act in waypoint.acts if act.kind is ActKind.WAIT
    )


@always(_SUCCESS, OURS)
def holds_are_held(end: GoalFinished, view: View, now_s: float) -> bool:
    """A route takes at least the hold times of its waypoints."""
    request = view.goal(end.goal_id).request
    if not isinstance(request, WaypointsRequest) or not _undisturbed(end, view, now_s):
        return True
    held_s = sum(map(_stay_s, request.waypoints)) * max(1, request.laps)
    return end.elapsed_s >= held_s - request.waypoints[-1].hold_time_s - 0.5


@always(_ended(OutcomeCode.ACT_FAILED), "docs/missions.md, acts")
def a_goal_ends_by_required_acts_alone(end: GoalFinished, view: View, now_s: float) -> bool:
    """ACT_FAILED is for a route by setpoints with an act that is required."""
    request = view.goal(end.goal_id).request
    acts = (
        [act for waypoint in request.waypoints for act in waypoint.acts]
        if isinstance(request, WaypointsRequest) and not request.by_mission
        else []
    )
    return any(act.required for act in acts)


@never(_ended(OutcomeCode.WAYPOINT_MISSED), "docs/navigate.md, missions")
def a_waypoint_missed_by_nobody(end: GoalFinished, view: View, now_s: float) -> bool:
    """A copter's mission that is left alone misses no waypoint."""
    goal = view.goal(end.goal_id)
    left_alone = not goal.paused and goal.paused_s == math.inf and view.calm(now_s, 60.0)
    return goal.by_mission and view.copter and left_alone and _undisturbed(end, view, now_s)


@never(_ended(OutcomeCode.CANCELED), "docs/navigate.md, missions")
def a_mission_left_behind(end: GoalFinished, view: View, now_s: float) -> bool:
    """A mission goal that a client cancels removes what it stored."""
    goal = view.goal(end.goal_id)
    asked = math.isfinite(goal.cancel_s) and not goal.disturbed and view.calm(now_s, 30.0)
    return asked and goal.by_mission and goal.stored and not goal.cleared


def _pilot_takes(entry: Entry, view: View) -> tuple[str, str] | None:
    if view.troubled or not (happens("pilot_mode", entry) or _moves_a_stick(entry, view)):
        return None
    now, mode = view.truth.mode, entry.value.how.get("mode", "POSCTL")
    request = view.flown.request
    steered = _led(view) or (view.hovers and isinstance(request, OrbitRequest | VelocityRequest))
    takes = steered and now == _CONTROL[view.craft.autopilot] != mode
    takes = takes or (view.flown.by_mission and now in ("AUTO", "AUTO.MISSION") and now != mode)
    lands = isinstance(view.flown.request, LandRequest | ReturnRequest) and mode in _BY_STICK
    lands = lands and now in ("LAND", "RTL", "AUTO.LAND", "AUTO.RTL")
    return (view.flown.goal_id, mode) if takes or lands else None


def _moves_a_stick(entry: Entry, view: View) -> bool:
    """Whether the pilot takes a copter by its stick; most are not obeyed in OFFBOARD."""
    obeys = view.copter and view.craft.sticks
    if not (obeys and happens("pilot_stick", entry) and abs(entry.value.how["forward"]) > 0.3):
        return False
    in_offboard = view.truth.mode == _CONTROL["px4"] and view.craft.firmware != "px4-1.18"
    return not in_offboard or view.craft.onboard.get("COM_RC_OVERRIDE") == 3.0


_BY_STICK = ("STABILIZE", "ALT_HOLD", "POSCTL", "ALTCTL", "MANUAL")


@within(lambda view: 6.0, _pilot_takes, "docs/ground_stations.md")
def a_pilot_ends_the_goal(view: View, key: Any, begun_s: float, now_s: float) -> bool:
    """A goal ends when the pilot changes the mode, on a link without faults."""
    goal_id, mode = key
    ended = a_goal_ends(view, goal_id, begun_s, now_s) or _troubled_since(view, begun_s)
    other = view.mode_s > begun_s + 2.0 or view.truth.mode != mode or view.taken_s > begun_s
    return ended or other


def _cleared_by_station(entry: Entry, view: View) -> str | None:
    seen = happens("station_clear", entry) and entry.value.how.get("seen", True)
    led = isinstance(view.flown.request, NavigateRequest | WaypointsRequest)
    return view.flown.goal_id if seen and led and view.active else None


@within(
    lambda view: view.config.bridge.goto.cancel_timeout_s + 25.0,
    _cleared_by_station,
    "docs/ground_stations.md",
)
def a_cleared_mission_ends_the_goal(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A ground station that removes the mission cancels the goal."""
    return a_goal_ends(view, goal_id, begun_s, now_s) or _troubled_since(view, begun_s)


@within(lambda view: 4.0, _cleared_by_station, "docs/ground_stations.md")
def a_cleared_mission_is_reported(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A goal whose mission a ground station removes says that it is being cancelled, or ends."""
    goal = view.goals.get(goal_id)
    if goal is None or goal.ends or view.taken_s > begun_s or not view.calm(now_s, 8.0):
        return True
    return goal.feedback is not None and goal.feedback.status is Status.CANCELLING


@never(_END, "docs/navigate.md, codes")
def a_failsafe_without_cause(end: GoalFinished, view: View, now_s: float) -> bool:
    """Nothing is called a failsafe when link, sensors and battery are well."""
    craft, well = view.craft, not view.troubled and view.trouble_s == -math.inf
    well = well and view.stalled_until_s == -math.inf
    return well and craft.battery == 1.0 and not craft.onboard and "FAILSAFE" in end.code.value


def _paused_by_station(entry: Entry, view: View) -> str | None:
    pauses = happens("station_pause", entry) and not entry.value.how["go_on"]
    seen = pauses and entry.value.how.get("seen", True)
    return view.flown.goal_id if seen and _led(view) else None


@within(lambda view: 25.0, _paused_by_station, "docs/ground_stations.md")
def a_station_pause_is_obeyed(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A ground station's pause cancels or pauses the goal."""
    goal = view.goals.get(goal_id)
    over = goal is None or bool(goal.ends) or goal.paused or view.speed_m_s < 0.6
    return over or view.taken_s > begun_s or _troubled_since(view, begun_s)


@within(lambda view: 14.0, lambda e, v: _active("shut_down")(e, v) if _led(v) else None, OURS)
def a_shut_down_is_in_time(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A server that is asked to end has ended its goal 14 s later, if the vehicle stands."""
    moves = any(math.hypot(*t.velocity_enu_m_s) > 0.3 for _, t in view.recent)
    over = a_goal_ends(view, goal_id, begun_s, now_s) or _troubled_since(view, begun_s)
    return over or moves or view.taken_s > begun_s


def _silenced(entry: Entry, view: View) -> str | None:
    on = happens("silence", entry) and entry.value.how["on"]
    return view.flown.goal_id if on and _led(view) else None


@within(lambda view: view.config.bridge.link_lost_abort_s + 4.0, _silenced, OURS)
def a_lost_link_ends_the_goal(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A goal ends when the vehicle has been silent for `link_lost_abort_s`."""
    again = "silence" not in view.troubled or view.stalled_until_s > begun_s
    return again or view.trouble_s > begun_s or a_goal_ends(view, goal_id, begun_s, now_s)


def _blinded(entry: Entry, view: View) -> str | None:
    on = happens("blind", entry) and entry.value.how["on"]
    return view.flown.goal_id if on and _led(view) and _avoids(view) else None


@within(lambda view: view.config.bridge.obstacles.sensor_timeout_s + 6.0, _blinded, PARAMETERS)
def a_blind_vehicle_stops(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A vehicle that avoids obstacles stops when its sensors fall silent, or its goal ends."""
    over = "blind" not in view.troubled or view.stalled_until_s > begun_s
    over = over or max(view.trouble_s, view.taken_s) > begun_s or bool(view.troubled - {"blind"})
    return over or a_goal_ends(view, goal_id, begun_s, now_s) or _stands(view, 0.5)


def _resumed_by_station(entry: Entry, view: View) -> str | None:
    resumes = happens("station_pause", entry) and entry.value.how["go_on"]
    seen = resumes and entry.value.how.get("seen", True)
    feedback = view.flown.feedback
    paused = feedback is not None and feedback.status is Status.PAUSED and _led(view)
    return view.flown.goal_id if seen and paused and math.isinf(view.flown.paused_s) else None


@within(lambda view: 12.0, _resumed_by_station, "docs/ground_stations.md")
def a_station_resumes_the_goal(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A goal that a ground station has paused continues when the station resumes it."""
    goal = view.goals.get(goal_id)
    over = goal is None or bool(goal.ends) or math.isfinite(min(goal.paused_s, goal.cancel_s))
    over = over or view.taken_s > begun_s or _troubled_since(view, begun_s)
    return over or (goal is not None and goal.feedback is not None
                    and goal.feedback.status is not Status.PAUSED)  # fmt: skip


def _pauses_the_goal(entry: Entry, view: View) -> str | None:
    pauses = view.craft.server.get("on_station_pause") == "pause"
    under_way = view.flown.feedback is not None and view.flown.feedback.status is Status.NAVIGATING
    return _paused_by_station(entry, view) if pauses and under_way else None


@within(lambda view: 6.0, _pauses_the_goal, "docs/ground_stations.md")
def a_station_pause_is_reported(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """With `on_station_pause` pause a goal that a ground station pauses says so, or ends."""
    goal = view.goals.get(goal_id)
    over = goal is None or bool(goal.ends) or goal.paused or math.isfinite(goal.cancel_s)
    return over or view.taken_s > begun_s or _troubled_since(view, begun_s)


def _outside(view: View, by_m: float) -> bool:
    """Whether it is truly outside of its flight volume, by more than that, over ground."""
    radius_m = view.config.bridge.volume.radius_max_m
    return math.hypot(*view.truth.position_enu_m[:2]) > radius_m + by_m


def _carried_out(entry: Entry, view: View) -> str | None:
    begun = view.flown.begun
    inside_m = view.config.bridge.volume.radius_max_m
    came = begun is not None and math.hypot(*begun.position_enu_m[:2]) < inside_m
    known = came and view.copter and _led(view) and not view.troubled - {"wind"}
    return view.flown.goal_id if known and entry.kind == "truth" and _outside(view, 10.0) else None


@within(lambda view: 5.0, _carried_out, PARAMETERS)
def a_goal_stops_outside_the_volume(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A goal whose vehicle is carried out of the flight volume is being cancelled, or ends."""
    over = a_goal_ends(view, goal_id, begun_s, now_s) or not _outside(view, 0.0)
    feedback = view.goal(goal_id).feedback
    over = over or (feedback is not None and feedback.status is Status.CANCELLING)
    return over or bool(view.troubled - {"wind"}) or view.stalled_until_s > begun_s


def _unlocated(entry: Entry, view: View) -> str | None:
    on = happens("unlocated", entry) and entry.value.how["on"]
    return view.flown.goal_id if on and _led(view) and not view.troubled else None


@within(lambda view: 9.0, _unlocated, OURS)
def a_vehicle_without_positions_stops(
    view: View, goal_id: str, begun_s: float, now_s: float
) -> bool:
    """A vehicle whose positions cease to arrive stops, or its goal ends."""
    over = "unlocated" not in view.troubled or view.stalled_until_s > begun_s
    over = over or max(view.trouble_s, view.taken_s) > begun_s
    return over or a_goal_ends(view, goal_id, begun_s, now_s) or _stands(view, 0.5)


def _disarmed_under_way(entry: Entry, view: View) -> str | None:
    disarms = happens("station_arm", entry) and not entry.value.how["arm"]
    drives = view.craft.kind in ("rover", "boat") and view.truth.armed and view.speed_m_s > 0.5
    return view.flown.goal_id if disarms and drives and view.active else None


@within(lambda view: 8.0, _disarmed_under_way, "docs/navigate.md, codes")
def a_disarmed_vehicle_ends_its_goal(
    view: View, goal_id: str, begun_s: float, now_s: float
) -> bool:
    """A goal ends when somebody disarms its vehicle under way."""
    over = a_goal_ends(view, goal_id, begun_s, now_s) or view.taken_s > begun_s
    over = over or any(truth.armed for _, truth in view.recent)
    return over or _troubled_since(view, begun_s)


def _arms_unheard(entry: Entry, view: View) -> int | None:
    arms = happens("serve", entry) and entry.value.how["service"] == "arm" and view.server
    unheard = arms and view.troubled == {"full"} and view.active is None and not view.truth.armed
    return view.armings if unheard else None


@within(lambda view: 1.2, _arms_unheard, "MAVLink command protocol")
def an_unheard_command_is_sent_again(
    view: View, armings: int, begun_s: float, now_s: float
) -> bool:
    """A command that is not answered is sent again."""
    asked = view.armings - armings
    over = view.truth.armed or view.server_s > begun_s or view.stalled_until_s > begun_s
    return asked != 1 or over


# --- feedback --------------------------------------------------------------------------------


@always(_FEEDBACK, ACTIONS)
def feedback_only_while_active(feedback: GoalFeedback, view: View, now_s: float) -> bool:
    """There is no feedback before acceptance or after the result."""
    return feedback.goal_id in view.goals and not view.goals[feedback.goal_id].ends


@always(_FEEDBACK, OURS)
def feedback_is_of_one_goal(feedback: GoalFeedback, view: View, now_s: float) -> bool:
    """One goal at a time is active: the one that was accepted last."""
    return view.active is None or feedback.goal_id == view.active.goal_id


@always(_FEEDBACK, OURS)
def feedback_is_finite(feedback: GoalFeedback, view: View, now_s: float) -> bool:
    """Distance and time remaining are finite and not negative."""
    numbers = (feedback.distance_remaining_m, feedback.time_remaining_s)
    return _finite(*numbers) and min(numbers) >= 0.0


@always(_FEEDBACK, "sensor_msgs/BatteryState")
def battery_is_a_share(feedback: GoalFeedback, view: View, now_s: float) -> bool:
    """The battery is a fraction from 0 to 1, or unknown."""
    return feedback.battery_remaining is None or 0.0 <= feedback.battery_remaining <= 1.0


@always(_FEEDBACK, "REP 103")
def pose_is_finite(feedback: GoalFeedback, view: View, now_s: float) -> bool:
    """A pose in feedback has finite numbers."""
    return feedback.pose is None or _finite(*feedback.pose.position_enu_m)


@always(_FEEDBACK, OURS)
def pose_is_true(feedback: GoalFeedback, view: View, now_s: float) -> bool:
    """The pose in feedback is where the vehicle is, by ground truth."""
    if feedback.pose is None or not view.calm(now_s, 60.0):
        return True
    off_m = math.dist(feedback.pose.position_enu_m[:2], view.truth.position_enu_m[:2])
    return off_m < 3.0 + 1.5 * view.speed_m_s


@always(_FEEDBACK, "REP 105, base_link")
def relative_targets_are_near(feedback: GoalFeedback, view: View, now_s: float) -> bool:
    """The first distance to a target in base_link is that which was asked for."""
    goal = view.goal(feedback.goal_id)
    request = goal.request
    if not isinstance(request, NavigateRequest) or request.frame_id != "base_link":
        return True
    if not view.copter or goal.disturbed or goal.feedback_s - goal.accepted_s > 0.3:
        return True
    if math.isfinite(goal.cancel_s) or math.isfinite(view.shut_down_s):
        return True
    off_m = abs(feedback.distance_remaining_m - math.hypot(*request.position))
    # A path may begin with braking and coming back, and where the setpoint was, not the vehicle.
    limit_m_s2 = view.config.bridge.goto.limits.acceleration_horizontal_m_s2
    return off_m < 4.0 + 2.0 * view.speed_m_s + 2.0 * view.speed_m_s**2 / limit_m_s2


def _feedback_of(entry: Entry, view: View) -> str | None:
    return view.active.goal_id if view.active and view.active.feedback is not None else None


@within(lambda view: 0.9, _feedback_of, OURS)
def feedback_flows(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """An active goal gives feedback at least once a second."""
    goal = view.goals.get(goal_id)
    return (
        goal is None
        or bool(goal.ends)
        or now_s - goal.feedback_s < 1.0
        or now_s < view.stalled_until_s + 1.0
    )


@always(_FEEDBACK, OURS)
def route_progress_is_consistent(feedback: GoalFeedback, view: View, now_s: float) -> bool:
    """The current waypoint and the lap exist."""
    request, route = view.goal(feedback.goal_id).request, feedback.route
    if route is None or not isinstance(request, WaypointsRequest):
        return True
    in_route = 0 <= route.current < len(request.waypoints)
    return in_route and 0 <= route.lap < max(1, request.laps)


@always(_FEEDBACK, OURS)
def passed_waypoints_were_passed(feedback: GoalFeedback, view: View, now_s: float) -> bool:
    """A vehicle that heads for a waypoint has truly been near those before it, or missed them."""
    goal, route = view.goal(feedback.goal_id), feedback.route
    if route is None or route.lap or not view.hovers or goal.disturbed or _avoids_any(goal):
        return True
    if not view.calm(now_s, 60.0) or {"WPNAV_RADIUS", "NAV_ACC_RAD"} & set(view.craft.onboard):
        return True
    # The firmwares cut corners, a PX4 by its NAV_ACC_RAD of 10 m.
    near_m = 6.0 if view.craft.autopilot == "ardupilot" else 12.0
    if any(index >= route.current for index in route.missed):
        return False
    alone = goal.by_mission and not goal.paused and math.isinf(min(goal.paused_s, goal.cancel_s))
    missed = () if alone else route.missed
    passed = (index for index in range(route.current) if index not in missed)
    return all(goal.nearest_m.get(index, 0.0) < near_m for index in passed)


@always(_SUCCESS, OURS)
def all_laps_are_flown(end: GoalFinished, view: View, now_s: float) -> bool:
    """A circle that succeeds has all its laps."""
    request = view.goal(end.goal_id).request
    return not isinstance(request, OrbitRequest) or abs(end.laps_flown - request.laps) < 1e-6


@always(_FEEDBACK, OURS)
def a_circle_is_kept(feedback: GoalFeedback, view: View, now_s: float) -> bool:
    """A copter that goes round is near its circle, as far as a wind lets it."""
    goal, orbit = view.goal(feedback.goal_id), feedback.orbit
    if orbit is None or math.isnan(orbit.radius_error_m) or not view.copter:
        return True
    near = abs(orbit.radius_error_m) < 2.0 + 0.5 * view.gust_m_s
    return near or goal.disturbed or not view.calm(now_s, 30.0) or _meets(view, now_s)


@never(_SUCCESS, OURS)
def a_success_without_the_target(end: GoalFinished, view: View, now_s: float) -> bool:
    """A goal that follows a target ends with SUCCESS only while it is not lost."""
    goal = view.goal(end.goal_id)
    if not isinstance(goal.request, FollowRequest) or now_s < view.stalled_until_s + 2.0:
        return False
    follow = None if goal.feedback is None else goal.feedback.follow
    return follow is None or follow.state is not FollowState.FOLLOWING


@never(_TRUTH, OURS)
def an_approach_within_the_least_distance(truth: Truth, view: View, now_s: float) -> bool:
    """A vehicle moves no nearer to its target than the least distance; only the target may."""
    request, target = view.flown.request, view.target_enu_m
    if not isinstance(request, FollowRequest) or target is None or view.active is None:
        return False
    if now_s - view.target_s > 0.3 or view.target_m_s > 0.1 or not _ours(view, now_s):
        return False
    away = np.subtract(truth.position_enu_m, target) * (1.0, 1.0, 1.0 if view.copter else 0.0)
    gap_m = float(np.linalg.norm(away))
    least_m = request.least_distance_m - 0.2 - 0.2 * view.gust_m_s
    if gap_m >= least_m or gap_m < 0.1 or now_s - view.flown.accepted_s < 8.0:
        return False
    return float(np.dot(truth.velocity_enu_m_s, away)) / gap_m < -0.4 - view.gust_m_s


def _marked(goal: Goal) -> bool:
    """Whether a goal lands on a mark."""
    return isinstance(goal.request, LandRequest) and bool(goal.request.target_topic)


def _needs_mark(goal: Goal) -> bool:
    """Whether a goal lands on a mark only."""
    return isinstance(goal.request, LandRequest) and goal.request.target_required


def _beside_mark_m(view: View) -> float:
    """The true distance over ground to where the mark was seen last."""
    return math.dist(view.truth.position_enu_m[:2], view.mark_enu_m[:2])


@never(_SUCCESS, "Land.action, target_required")
def a_landing_beside_the_mark(end: GoalFinished, view: View, now_s: float) -> bool:
    """A Land that requires its target succeeds on it only, where it was seen last."""
    goal = view.goal(end.goal_id)
    if not _needs_mark(goal) or not _undisturbed(end, view, now_s):
        return False
    return view.mark_s <= goal.accepted_s or _beside_mark_m(view) > OFF_MAX_M + 0.3


@always(_SUCCESS, "Land.action, lateral_error")
def the_lateral_error_is_true(end: GoalFinished, view: View, now_s: float) -> bool:
    """The lateral error of a landing is the true distance to where the target was seen last."""
    goal, error_m = view.goal(end.goal_id), end.final_error_m
    if not _marked(goal) or error_m is None or not _undisturbed(end, view, now_s):
        return True
    return view.mark_s > goal.accepted_s and abs(error_m - _beside_mark_m(view)) < 0.5


@never(_TRUTH, "Land.action, target_required")
def a_touchdown_without_the_mark(truth: Truth, view: View, now_s: float) -> bool:
    """A Land that requires its target comes to the ground only after it has just seen it."""
    goal = view.flown
    if not _needs_mark(goal) or not truth.on_ground or not _ours(view, now_s):
        return False
    if now_s - goal.accepted_s < _LANDS_S:
        return False  # it was about to touch the ground when it was asked to land
    flew = any(not before.on_ground for _, before in view.recent)
    seen_s = view.mark_s if view.mark_s > goal.accepted_s else -math.inf
    return flew and math.isinf(goal.cancel_s) and now_s - seen_s > _UNSEEN_S


@always(_SETPOINTS, "NavigateWaypoints.action, yaw_rate")
def a_route_turns_at_its_rate(message: Message, view: View, now_s: float) -> bool:
    """A copter on a route with a yaw rate is not turned faster, nor the other way."""
    request, before = view.flown.request, view.before
    if not isinstance(request, WaypointsRequest) or not request.yaw_rate_rad_s:
        return True
    passed_s = now_s - view.before_s
    if before is None or passed_s > 0.3 or view.before_s < view.flown.accepted_s + 5.0:
        return True
    if (message.type_mask | before.type_mask) & mavlink.POSITION_TARGET_TYPEMASK_YAW_IGNORE:
        return True
    # Counter-clockwise is negative in NED.
    turned_rad = math.remainder(before.yaw - message.yaw, math.tau)
    wanted_rad = request.yaw_rate_rad_s * (passed_s + 0.03)
    least_rad, most_rad = sorted((0.0, wanted_rad))
    return least_rad - 0.002 < turned_rad < most_rad + 0.002


@always(_FEEDBACK, OURS)
def link_lost_is_reported(feedback: GoalFeedback, view: View, now_s: float) -> bool:
    """A vehicle that is silent is not reported as navigating."""
    silent = "silence" in view.troubled and now_s - view.trouble_s > 5.0
    return not silent or feedback.status is Status.LINK_LOST


@always(_TRUTH, OURS)
def paused_stands(truth: Truth, view: View, now_s: float) -> bool:
    """12 s after a pause what can stand still stands, by ground truth."""
    feedback = view.flown.feedback
    if feedback is None or feedback.status is not Status.PAUSED or not view.hovers:
        return True
    if _meets(view, now_s):
        return True
    since_s = now_s - view.flown.paused_s
    return not view.calm(now_s, 12.0) or since_s < 12.0 or _stands(view, 1.0)


def _pauses(entry: Entry, view: View) -> bool:
    """Whether a client pauses a goal that is under way."""
    feedback = view.flown.feedback
    navigates = feedback is not None and feedback.status is Status.NAVIGATING
    return happens("pause", entry) and navigates


def _tells_of_pause(view: View, goal_id: str, now_s: float, calm_s: float) -> bool:
    """Whether a goal has reported its pause, or is excused: it ended, continued, was disturbed."""
    goal = view.goals.get(goal_id)
    if goal is None or goal.ends or math.isfinite(goal.cancel_s) or goal.paused_s == math.inf:
        return True
    return goal.paused or goal.disturbed or not view.calm(now_s, calm_s)


def _paused(entry: Entry, view: View) -> str | None:
    return view.flown.goal_id if _pauses(entry, view) and _led(view) else None


@within(lambda view: 1.5, _paused, OURS)
def a_pause_is_reported(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A goal that is paused says so at once, unless it ends or resumes."""
    return _tells_of_pause(view, goal_id, now_s, 3.0)


def _paused_mission(entry: Entry, view: View) -> str | None:
    mission = view.flown.by_mission and view.hovers
    return view.flown.goal_id if _pauses(entry, view) and mission else None


@within(lambda view: 5.0, _paused_mission, OURS)
def a_paused_mission_is_reported(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A mission that is paused says so when the vehicle holds, unless it ends or resumes."""
    return _tells_of_pause(view, goal_id, now_s, 5.0)


# --- what is commanded -----------------------------------------------------------------------


@never(_SETPOINTS, OURS)
def moved_without_a_goal(message: Message, view: View, now_s: float) -> bool:
    """No setpoint moves a vehicle that has no goal."""
    return view.active is None and speed_of(message) > 0.01 and now_s - view.left_s > 0.1


@never(_SETPOINTS, OURS)
def setpoints_long_after(message: Message, view: View, now_s: float) -> bool:
    """30 s after a goal's end no setpoint is sent."""
    return view.active is None and now_s - view.left_s > 30.0 and not _serving(view, now_s)


@never(_SETPOINTS, "ArduPilot and PX4 ignore it, and what comes later is not meant")
def moved_outside_the_control_mode(message: Message, view: View, now_s: float) -> bool:
    """Nothing moves by setpoints before the mode is confirmed, or after it was left."""
    outside = view.truth.mode != _CONTROL[view.craft.autopilot]
    settled = now_s - view.mode_s > _ANSWER_S and view.calm(now_s, _ANSWER_S)
    return outside and settled and speed_of(message) > 0.01


@never(_SET_MODE, OURS)
def a_mode_changed_unasked(message: Message, view: View, now_s: float) -> bool:
    """Without a goal or a service no mode is asked for; so no pilot is fought."""
    return view.active is None and not _serving(view, now_s) and now_s - view.left_s > 35.0


@never(_command(*_TAKING), OURS)
def taken_from_a_pilot(message: Message, view: View, now_s: float) -> bool:
    """After PILOT_OVERRIDE neither a mode nor the motors are asked for, unless a client asks."""
    if view.active is not None or view.last is None or _serving(view, now_s):
        return False
    return any(end.code is OutcomeCode.PILOT_OVERRIDE for end in view.last.ends)


@never(_ARM, PARAMETERS)
def armed_without_permission(message: Message, view: View, now_s: float) -> bool:
    """Nothing arms with `arming` never."""
    return bool(message.param1 == 1.0) and _arming(view) == "never"


@never(_ARM, OURS)
def armed_unasked(message: Message, view: View, now_s: float) -> bool:
    """Nothing arms without a goal or a service."""
    return bool(message.param1 == 1.0) and view.active is None and not _serving(view, now_s)


@never(_ARM, "MAV_CMD_COMPONENT_ARM_DISARM")
def arming_forced(message: Message, view: View, now_s: float) -> bool:
    """Arming and disarming are never forced."""
    return bool(message.param2 != 0.0)


@never(_ARM, OURS)
def disarmed_in_the_air(message: Message, view: View, now_s: float) -> bool:
    """Motors are not stopped in the air."""
    # A vehicle that has just left the ground rejects it; the server cannot know that yet.
    stood = any(truth.on_ground for time_s, truth in view.recent if time_s > now_s - _REPORTED_S)
    flies = view.craft.kind in ("copter", "plane") and not (view.truth.on_ground or stood)
    asked = _serving(view, now_s)
    return bool(message.param1 == 0.0) and flies and not asked and view.calm(now_s, _ANSWER_S)


@never(_command(mavlink.MAV_CMD_NAV_TAKEOFF), PARAMETERS)
def taken_off_without_permission(message: Message, view: View, now_s: float) -> bool:
    """Nothing takes off with `arming` never."""
    return _arming(view) == "never"


@always(_SETPOINTS, SETPOINT)
def setpoints_are_finite(message: Message, view: View, now_s: float) -> bool:
    """No field that counts is NaN or infinite."""
    names = (*("x", "y", "z"), *("vx", "vy", "vz"), *("afx", "afy", "afz"), "", "yaw", "yaw_rate")
    fields = [(1 << bit, name) for bit, name in enumerate(names) if name and hasattr(message, name)]
    return _finite(*(getattr(message, n) for bit, n in fields if not message.type_mask & bit))


@always(sent(SETPOINTS[0]), SETPOINT)
def setpoints_have_a_known_frame(message: Message, view: View, now_s: float) -> bool:
    """Local setpoints are in MAV_FRAME_LOCAL_NED; speeds of what drives may be in BODY_NED."""
    frame, drives = message.coordinate_frame, view.craft.kind in ("rover", "boat")
    along = drives and frame == mavlink.MAV_FRAME_BODY_NED
    return bool(frame == mavlink.MAV_FRAME_LOCAL_NED or along)


@always(sent(SETPOINTS[0]), "REP 103, MAV_FRAME_LOCAL_NED")
def setpoints_lead_to_the_target(message: Message, view: View, now_s: float) -> bool:
    """5 s after a copter's Navigate goal and change of mode its velocities lead to the target."""
    goal, target = view.flown, _target(view.flown.request)
    if not isinstance(goal.request, NavigateRequest) or target is None or _gives_way(view):
        return True
    held = goal.feedback is None or goal.feedback.status is not Status.NAVIGATING
    # A path begins with the motion that a take-off has left.
    since_s = max(goal.accepted_s, view.mode_s)
    if held or not view.copter or now_s - since_s < 5.0 or not _ours(view, now_s):
        return True
    velocity_m_s, place = (message.vy, message.vx), view.truth.position_enu_m[:2]
    if math.hypot(*velocity_m_s) < 1.0 or math.dist(target[:2], place) < 8.0:
        return True
    along = sum(v * (t - p) for v, t, p in zip(velocity_m_s, target, place, strict=False))
    # A vehicle that was under way before this goal is still being slowed down.
    turns = any(math.hypot(*t.velocity_enu_m_s[:2]) > 1.0 for s, t in view.recent if s < now_s - 2)
    return along > 0.0 or (turns and now_s - goal.accepted_s < 15.0) or not view.calm(now_s, 60.0)


@always(sent(SETPOINTS[0]), "REP 103, MAV_FRAME_LOCAL_NED")
def setpoints_are_on_the_line(message: Message, view: View, now_s: float) -> bool:
    """The positions that a copter is sent on a Navigate goal are near the line to its target."""
    goal, target = view.flown, _target(view.flown.request)
    if not isinstance(goal.request, NavigateRequest) or target is None or _gives_way(view):
        return True
    if goal.begun is None or not view.copter or not _ours(view, now_s):
        return True
    if message.type_mask & 0b000011 or math.isfinite(goal.paused_s):
        return True
    begun, place = goal.begun.position_enu_m[:2], (message.y, message.x)
    # It is slowed down along the course that it had.
    aside_m = 8.0 + 4.0 * math.hypot(*goal.begun.velocity_enu_m_s)
    return _from_line_m(begun, target[:2], place) < aside_m or not view.calm(now_s, 60.0)


@always(_command(mavlink.MAV_CMD_DO_REPOSITION), "docs/velocity.md, Planes")
def a_course_stays_in_the_volume(message: Message, view: View, now_s: float) -> bool:
    """A plane that follows commands is sent to places whose circle is in the flight volume."""
    if message.get_type() != "COMMAND_INT" or not isinstance(view.flown.request, VelocityRequest):
        return True
    latitude, longitude, _ = view.craft.home
    north_m = (message.x / 1e7 - latitude) * _DEGREE_M
    off_deg = math.remainder(message.y / 1e7 - longitude, 360.0)
    east_m = off_deg * _DEGREE_M * math.cos(math.radians(latitude))
    inside_m = view.config.bridge.volume.radius_max_m - _PLANE_CIRCLE_M
    # Outside, it circles where it is until a command leads back.
    outside = math.hypot(*view.truth.position_enu_m[:2]) > inside_m - _PLANE_CIRCLE_M
    return outside or math.hypot(north_m, east_m) <= inside_m


@always(_SETPOINTS, "MAVLink routing")
def setpoints_are_addressed(message: Message, view: View, now_s: float) -> bool:
    """They go to one vehicle, not to all."""
    return bool(message.target_system >= 1) and message.target_component in (0, 1)


@always(_SETPOINTS, PARAMETERS)
def setpoints_keep_the_speed_limit(message: Message, view: View, now_s: float) -> bool:
    """They are not faster than the server's maximum speed."""
    return math.hypot(message.vx, message.vy) <= 1.02 * _speed_max_m_s(view) + 0.1 or bool(
        message.type_mask & mavlink.POSITION_TARGET_TYPEMASK_VX_IGNORE
    )


@always(_SETPOINTS, PARAMETERS)
def setpoints_climb_within_limits(message: Message, view: View, now_s: float) -> bool:
    """Climb and descent keep to their limits, but for a vehicle that moves faster by itself."""
    if now_s - view.flown.accepted_s < 4.0 or view.active is None:
        return True
    limits = view.config.bridge.goto.limits
    lowest_m_s, highest_m_s = -1.02 * limits.speed_up_m_s, 1.02 * limits.speed_down_m_s
    # A take-off is the autopilot's; it is stopped from its own speed.
    moving_m_s = abs(view.truth.velocity_enu_m_s[2]) + 0.1
    lowest_m_s, highest_m_s = min(lowest_m_s, -moving_m_s), max(highest_m_s, moving_m_s)
    return bool(lowest_m_s - 0.1 <= message.vz <= highest_m_s + 0.1)


def _is_led(view: View) -> bool:
    """Return whether setpoints lead the motion, and are not the motion itself.

    A part of an ArduCopter's brakes is in the position (navigation_core/safety/late_setpoints.py);
    tests/property/test_unfollowed.py holds the motion that comes of it.
    """
    return view.craft.autopilot == "ardupilot"


def _velocities(
    message: Message, by_positions_m_s: tuple[float, float]
) -> tuple[tuple[float, float], ...]:
    """Return the velocities that a setpoint may mean: one next to nothing may be left out."""
    sent_m_s = (message.vx, message.vy)
    return (sent_m_s,) if speed_of(message) > _STANDS_M_S else (sent_m_s, by_positions_m_s)


@always(_SETPOINTS, PARAMETERS)
def setpoints_accelerate_within_limits(message: Message, view: View, now_s: float) -> bool:
    """Their velocity changes within the acceleration limit, also where positions alone are sent."""
    before = view.before
    if before is None or not _ours(view, now_s) or now_s - view.flown.accepted_s < 0.5:
        return True
    if _avoids(view):
        return True
    if (message.type_mask | before.type_mask) & 0b001001 or _is_led(view):
        return True
    limit_m_s2 = view.config.bridge.goto.limits.acceleration_horizontal_m_s2
    moved_m = math.dist((message.x, message.y), (before.x, before.y))
    if moved_m > 1.0 + 2.0 * speed_of(before) * (now_s - view.before_s):
        return True  # begun again where the vehicle is, which was far behind
    passed_s = max(0.02, now_s - view.before_s)
    # Near traffic and bounds the velocity is left out: that of the positions may count.
    by_positions_m_s = ((message.x - before.x) / passed_s, (message.y - before.y) / passed_s)
    change_m_s = min(
        math.dist(after, was)
        for after in _velocities(message, by_positions_m_s)
        for was in _velocities(before, by_positions_m_s)
    )
    return change_m_s <= 2.0 * limit_m_s2 * passed_s + 0.1


@always(sent(SETPOINTS[0]), PARAMETERS)
def setpoints_stay_in_the_volume(message: Message, view: View, now_s: float) -> bool:
    """No position is far outside of the flight volume."""
    if message.type_mask & mavlink.POSITION_TARGET_TYPEMASK_X_IGNORE:
        return True
    return math.hypot(message.x, message.y) <= view.config.bridge.volume.radius_max_m + 60.0


def _moves(entry: Entry, view: View) -> str | None:
    message = _SETPOINTS(entry)
    return "gap" if message is not None and speed_of(message) > 0.3 else None


@within(lambda view: 0.5, _moves, "PX4 COM_OF_LOSS_T, ArduPilot GUID_TIMEOUT")
def setpoints_flow(view: View, key: str, begun_s: float, now_s: float) -> bool:
    """While a goal is flown by setpoints their gap stays below 0.5 s."""
    ended = view.active is None or view.active.accepted_s >= begun_s or view.truth.collided
    # On the ground, before the landing is noticed, the server waits for that.
    flows = view.setpoint_s > begun_s or view.truth.on_ground
    return flows or ended or not view.calm(now_s, 2.0)


@always(sent(), OURS)
def the_link_is_not_flooded(message: Message, view: View, now_s: float) -> bool:
    """At most 150 messages are sent in a second."""
    return len(view.sent_s) <= 150


@never(sent("PARAM_SET", "PARAM_EXT_SET"), OURS)
def a_parameter_written(message: Message, view: View, now_s: float) -> bool:
    """The server sets no parameter of the autopilot."""
    return True


@never(
    _command(
        mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN,
        mavlink.MAV_CMD_DO_FLIGHTTERMINATION,
        mavlink.MAV_CMD_DO_SET_HOME,
    ),
    OURS,
)
def a_reboot_or_another_home(message: Message, view: View, now_s: float) -> bool:
    """The server never reboots a vehicle, terminates a flight, or moves home."""
    return True


@never(sent("MISSION_COUNT", "MISSION_CLEAR_ALL", "MISSION_SET_CURRENT"), OURS)
def a_mission_touched_unasked(message: Message, view: View, now_s: float) -> bool:
    """No mission is stored, cleared or moved without a goal of that kind."""
    goals = (view.active, view.last)
    return not any(goal is not None and goal.by_mission for goal in goals)


def _mission_begins(entry: Entry, view: View) -> str | None:
    mode = _SET_MODE(entry)
    modes = {"ardupilot": (3.0,), "px4": (4.0, 4.0)}[view.craft.autopilot]
    begins = mode is not None and (mode.param2, mode.param3)[: len(modes)] == modes
    begins = begins or _command(mavlink.MAV_CMD_MISSION_START)(entry) is not None
    return view.flown.goal_id if begins and view.flown.by_mission else None


@within(lambda view: 0.3, _mission_begins, OURS)
def a_mission_is_whole(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A mission that is begun is in the vehicle as it was sent."""
    goal = view.goal(goal_id)
    if goal.ends or goal.disturbed or not view.calm(now_s, 5.0):
        return True
    home = 1 if view.craft.autopilot == "ardupilot" else 0
    return view.truth.mission == tuple(view.items[seq] for seq in sorted(view.items))[home:]


@within(lambda view: 0.3, _mission_begins, "MAV_CMD_DO_CHANGE_SPEED")
def a_mission_has_its_speed(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """A mission that is begun asks for no more than the goal's `max_speed`."""
    wanted_m_s = getattr(view.goal(goal_id).request, "max_speed_m_s", 0.0)
    if wanted_m_s <= 0.0 or not view.items or view.flown.goal_id != goal_id:
        return True  # a goal that replaces it sends its own mission
    return view.item_speed_m_s <= wanted_m_s + 0.01


@never(sent("MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE"), OURS)
def a_stick_moved(message: Message, view: View, now_s: float) -> bool:
    """The server never acts as a pilot's stick."""
    return True


@always(_SETPOINTS, SETPOINT)
def headings_are_in_radians(message: Message, view: View, now_s: float) -> bool:
    """A heading that counts is between -pi and pi."""
    counts = not message.type_mask & mavlink.POSITION_TARGET_TYPEMASK_YAW_IGNORE
    return not counts or bool(abs(message.yaw) < 3.15)


@always(_command(mavlink.MAV_CMD_NAV_TAKEOFF), "MAV_CMD_NAV_TAKEOFF")
def takeoffs_are_low(message: Message, view: View, now_s: float) -> bool:
    """A take-off is commanded to a height between 0 and 200 m above where the vehicle began."""
    height_m = getattr(message, "param7", None)
    height_m = message.z if height_m is None else height_m
    # A PX4's is above the sea, an ArduPilot's above home, which a ground station may have moved.
    is_px4 = view.craft.autopilot == "px4"
    added_m = (-view.craft.home[2],) if is_px4 else view.homes_up_m
    return any(-5.0 < height_m + each_m < 200.0 for each_m in added_m)


_ITEMS = sent("MISSION_ITEM_INT")
_ABOVE_HOME = (mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)


@always(_ITEMS, "MAV_FRAME, mission protocol")
def mission_items_are_near(item: Message, view: View, now_s: float) -> bool:
    """A place of a mission that is sent is a few kilometres from home, and no mountain."""
    has_place = item.frame != mavlink.MAV_FRAME_MISSION and not item.x == item.y == 0
    if item.mission_type != 0 or not has_place:
        return True
    latitude_deg, longitude_deg, altitude_m = view.craft.home
    east_deg = (1e-7 * item.y - longitude_deg + 180.0) % 360.0 - 180.0
    up_m = item.z if item.frame in _ABOVE_HOME else item.z - altitude_m
    away_deg = max(abs(1e-7 * item.x - latitude_deg), abs(east_deg))
    return bool(away_deg < 0.1 and abs(up_m) < 250.0)


@always(_ITEMS, "MAV_CMD_NAV_WAYPOINT")
def mission_items_have_their_holds(item: Message, view: View, now_s: float) -> bool:
    """A waypoint of a mission that is sent has the hold time that was asked for."""
    request = view.stored_for
    if not isinstance(request, WaypointsRequest) or not request.by_mission or not view.hovers:
        return True
    ardupilot = view.craft.autopilot == "ardupilot"
    if ardupilot and request.waypoints[-1].acts:
        return True  # the last waypoint is there twice
    is_home = item.seq == 0 and ardupilot
    if item.mission_type != 0 or is_home or item.command != mavlink.MAV_CMD_NAV_WAYPOINT:
        return True
    return bool(item.param1 >= min(waypoint.hold_time_s for waypoint in request.waypoints))


_STEERED = (FollowRequest, TrajectoryRequest, VelocityRequest)


@always(sent(SETPOINTS[0]), SETPOINT)
def velocities_fit_positions(message: Message, view: View, now_s: float) -> bool:
    """A copter's setpoints are no faster than their positions move.

    Those that follow a command or a target stay near a vehicle that lags
    (navigation_core/tasks/steering/flown_reference.py).
    """
    before, since_s = view.before, now_s - view.before_s
    if before is None or not view.copter or not 0.01 < since_s < 0.3 or not _ours(view, now_s):
        return True
    if (message.type_mask | before.type_mask) & 0b001001 or now_s - view.flown.accepted_s < 2.0:
        return True
    if _avoids(view) or _is_led(view) or isinstance(view.flown.request, _STEERED):
        return True
    moved_m_s = math.dist((message.x, message.y), (before.x, before.y)) / since_s
    return math.hypot(message.vx, message.vy) <= 1.25 * moved_m_s + 0.3


@always(_SETPOINTS, "docs/navigate.md, max_speed")
def setpoints_keep_the_goals_speed(message: Message, view: View, now_s: float) -> bool:
    """They are not faster than the goal's `max_speed`, but for a vehicle that moves faster."""
    wanted_m_s = getattr(view.flown.request, "max_speed_m_s", 0.0)
    if wanted_m_s <= 0.0 or abs(message.vz) > 0.5 * wanted_m_s:
        return True
    if view.troubled:
        return True  # a stuck estimate moves on, and is what a vehicle is slowed down from
    begun = view.flown.begun
    stood = begun is not None and math.hypot(*begun.velocity_enu_m_s) < 0.3
    if not stood and now_s - view.flown.accepted_s < 20.0:
        return True
    moved_m_s = max(math.hypot(*truth.velocity_enu_m_s) for _, truth in view.recent)
    return speed_of(message) <= max(1.05 * wanted_m_s, moved_m_s) + 0.2


# --- lies ------------------------------------------------------------------------------------


def _contradicted(view: View, now_s: float) -> bool:
    """Whether lies and the vehicle's own reports have contradicted each other for long enough."""
    sure_s = 3.5 * max(view.lie_period_s, 1.0) + 2.0
    alone = view.troubled == {"lie"} and now_s - max(view.taken_s, view.stalled_until_s) > sure_s
    return alone and now_s - view.denied_s > sure_s


@never(_SUCCESS, "Damn Vulnerable Drone")
def a_success_on_contradictory_reports(end: GoalFinished, view: View, now_s: float) -> bool:
    """Nothing succeeds while somebody contradicts the vehicle with its own ids, again and again."""
    return _contradicted(view, now_s)


@never(of_kind("asked"), "Damn Vulnerable Drone")
def a_goal_accepted_on_contradictory_reports(asked: Asked, view: View, now_s: float) -> bool:
    """Meanwhile no goal but a landing and a return is accepted."""
    by_itself = isinstance(asked.request, LandRequest | ReturnRequest)
    return bool(asked.goal_id) and not by_itself and _contradicted(view, now_s)


@never(_SUCCESS, "Damn Vulnerable Drone")
def a_landing_by_a_lie(end: GoalFinished, view: View, now_s: float) -> bool:
    """A Land does not succeed in the air, whatever is sent with the vehicle's ids."""
    if not isinstance(view.goal(end.goal_id).request, LandRequest):
        return False
    return view.troubled <= {"lie"} and not view.truth.on_ground


@never(_TRUTH, "SwarmFuzz, LiTelFuzz")
def a_meeting_because_of_another(truth: Truth, view: View, now_s: float) -> bool:
    """Two vehicles whose servers report the truth do not meet, whatever a third one reports."""
    if truth.on_ground or view.misreported:
        return False
    if not any(other.misreported for other in view.fleet):
        return False
    return any(
        not other.misreported
        and not other.truth.on_ground
        and other is not view
        and math.dist(_from_first_m(view), _from_first_m(other)) < 2.0 * _HULL_M
        for other in view.fleet
    )


def _from_first_m(view: View) -> tuple[float, float, float]:
    """Return where it truly is, from where the first vehicle of its fleet began."""
    first, own, place = view.fleet[0].craft.home, view.craft.home, view.truth.position_enu_m
    shrunk_m = _DEGREE_M * math.cos(math.radians(first[0]))
    east_m, north_m = shrunk_m * (own[1] - first[1]), _DEGREE_M * (own[0] - first[0])
    return (place[0] + east_m, place[1] + north_m, place[2] + own[2] - first[2])


_EVADING = (NavigateRequest, WaypointsRequest, OrbitRequest)
# An intruder is known, and setpoints lead the vehicle, this long before it can be too near.
_EVADES_S = 8.0


def _is_led_aside(view: View, now_s: float) -> bool:
    """Whether the goal that is flown gives way to intruders, and has for a while."""
    goal = view.flown
    if not isinstance(goal.request, _EVADING) or goal.by_mission or not _ours(view, now_s):
        return False
    begun_s = max(goal.accepted_s, view.led_s if view.hovers else goal.accepted_s)
    flew = goal.begun is not None and not goal.begun.on_ground
    return now_s - begun_s > _EVADES_S and (view.copter or (flew and not view.hovers))


@never(_TRUTH, "docs/fleet.md, Others")
def an_intruder_too_near(truth: Truth, view: View, now_s: float) -> bool:
    """A vehicle that a goal leads keeps the separation to aircraft that it has known for 8 s."""
    if truth.on_ground or not view.craft.sees_traffic or not _is_led_aside(view, now_s):
        return False
    separation = view.config.bridge.traffic.separation
    for seen_s, met in view.met.values():
        if now_s - seen_s > 0.5 or now_s - met.reported_s < _EVADES_S:
            continue
        there = np.add(met.position_enu_m, (now_s - seen_s) * np.array(met.velocity_enu_m_s))
        east, north, up = there - np.array(truth.position_enu_m)
        level = math.hypot(east, north) < separation.horizontal_m
        if level and abs(up) < separation.vertical_m:
            return True
    return False


# --- ground truth ----------------------------------------------------------------------------


@never(_TRUTH, OURS)
def an_obstacle_hit(truth: Truth, view: View, now_s: float) -> bool:
    """No obstacle is hit by a vehicle that avoids obstacles."""
    if now_s != view.hit_s or not _ours(view, now_s) or not _avoids(view):
        return False
    return not _begun_too_near(view.flown, view.last, now_s)


@never(_TRUTH, OURS)
def an_obstacle_grazed(truth: Truth, view: View, now_s: float) -> bool:
    """The hull of a vehicle that avoids obstacles stays clear of them."""
    began = now_s - view.flown.accepted_s > 3.0 and not truth.on_ground and not truth.collided
    return truth.clearance_m < _HULL_M and began and _ours(view, now_s) and _avoids(view)


@never(_TRUTH, "physics")
def below_the_ground(truth: Truth, view: View, now_s: float) -> bool:
    """No vehicle that we fly is below the ground."""
    # One that restarted in the air counts from there.
    low = truth.position_enu_m[2] < -1.0 and view.rebooted_s == -math.inf
    return low and _ours(view, now_s)


@never(_TRUTH, OURS)
def the_volume_left(truth: Truth, view: View, now_s: float) -> bool:
    """The flight volume is not left because of us."""
    limit_m = view.config.bridge.volume.radius_max_m + (20.0 if view.hovers else 200.0)
    rolls = truth.on_ground and not view.hovers  # a take-off that is too slow for the tail wind
    return _ours(view, now_s) and not rolls and math.hypot(*truth.position_enu_m[:2]) > limit_m


@never(_TRUTH, OURS)
def the_ceiling_left(truth: Truth, view: View, now_s: float) -> bool:
    """The volume's ceiling is not left because of us."""
    returns = isinstance(view.flown.request, ReturnRequest)
    ceiling_m = view.config.bridge.volume.altitude_max_m
    begun = view.flown.begun
    # A return that was asked for as a mode climbs above it. The next goal brings the vehicle back.
    was_above = begun is not None and begun.position_enu_m[2] > ceiling_m
    if was_above and now_s - view.flown.accepted_s < 30.0:
        return False
    return _ours(view, now_s) and not returns and truth.position_enu_m[2] > ceiling_m + 5.0


def _was_steered(view: View) -> bool:
    """Whether velocity commands moved it last, and nobody has asked for anything since."""
    goal = view.active or view.last or NO_GOAL
    return view.released is not None and isinstance(goal.request, VelocityRequest)


@never(_TRUTH, "docs/velocity.md")
def moving_without_commands(truth: Truth, view: View, now_s: float) -> bool:
    """A vehicle that can stand still stands 10 s after the last velocity command."""
    if not view.hovers or not _was_steered(view) or not view.calm(now_s, 15.0):
        return False
    return not _stands(view, 0.5)


@never(_TRUTH, "docs/velocity.md, Planes")
def a_plane_gone_without_commands(truth: Truth, view: View, now_s: float) -> bool:
    """A plane circles from 10 s after the last velocity command on."""
    if view.hovers or view.released is None or not _was_steered(view) or not _ours(view, now_s):
        return False
    gone_m = math.dist(truth.position_enu_m[:2], view.released.position_enu_m[:2])
    return gone_m > 6.0 * _PLANE_CIRCLE_M


@never(_TRUTH, "ArduPilot FENCE_RADIUS, PX4 GF_MAX_HOR_DIST")
def the_fence_left(truth: Truth, view: View, now_s: float) -> bool:
    """The vehicle's own fence is not left because of us."""
    # A flight by the autopilot itself is not judged.
    led = isinstance(view.flown.request, VelocityRequest) or _led(view)
    known = view.copter and led and now_s - max(view.server_s, view.set_s) > 20.0
    return known and _ours(view, now_s) and _is_fenced_off(view, truth.position_enu_m, 0.0)


@never(_TRUTH, PARAMETERS)
def too_fast(truth: Truth, view: View, now_s: float) -> bool:
    """The true speed stays near the maximum."""
    goal = view.flown
    led = isinstance(goal.request, NavigateRequest | WaypointsRequest) and not goal.by_mission
    led = led and view.hovers and now_s - goal.accepted_s > 10.0
    speed_m_s = math.hypot(*truth.velocity_enu_m_s[:2])
    return led and _ours(view, now_s) and speed_m_s > 1.3 * _speed_max_m_s(view) + 2.0


@never(_TRUTH, PARAMETERS)
def armed_by_us(truth: Truth, view: View, now_s: float) -> bool:
    """With `arming` never, and nobody else there, the vehicle stays disarmed."""
    alone = view.taken_s == view.trouble_s == -math.inf
    return truth.armed and alone and _arming(view) == "never"


@never(_TRUTH, "physics")
def a_fall(truth: Truth, view: View, now_s: float) -> bool:
    """Nothing that we fly falls."""
    fell_s = now_s - view.flown.accepted_s
    flies = view.copter and _ours(view, now_s) and fell_s > 3.0 and not truth.collided
    return flies and truth.velocity_enu_m_s[2] < -6.0


@never(_TRUTH, OURS)
def a_flight_away(truth: Truth, view: View, now_s: float) -> bool:
    """A copter that has arrived stays there, until a service, somebody else or trouble moves it."""
    last = view.last
    if view.active is not None or last is None or not last.ends or not view.copter:
        return False
    left = last.ends[0].code is OutcomeCode.SUCCESS and not last.disturbed
    left = left and isinstance(last.request, NavigateRequest) and view.calm(now_s, 20.0)
    moved_s = max(view.served_s, view.taken_s, view.trouble_s, view.stalled_until_s)
    left = left and now_s - last.ended_s > 5.0 and moved_s <= last.ended_s
    return left and math.hypot(*truth.velocity_enu_m_s[:2]) > 2.5


@never(_TRUTH, "docs/navigate.md, max_speed")
def a_mission_too_fast(truth: Truth, view: View, now_s: float) -> bool:
    """A copter in a mission keeps the speed that the goal asked for."""
    goal = view.flown
    wanted_m_s = getattr(goal.request, "max_speed_m_s", 0.0)
    asked = goal.by_mission and view.copter and wanted_m_s > 0.0 and now_s - goal.accepted_s > 20.0
    speed_m_s = math.hypot(*truth.velocity_enu_m_s[:2])
    return asked and _ours(view, now_s) and speed_m_s > 1.3 * wanted_m_s + 1.5


@never(_TRUTH, OURS)
def navigating_without_motors(truth: Truth, view: View, now_s: float) -> bool:
    """A vehicle that has been disarmed for seconds is not reported as navigating."""
    feedback = view.flown.feedback
    if feedback is None or feedback.status is not Status.NAVIGATING or not view.calm(now_s, 3.5):
        return False
    off = view.recent[0][0] < now_s - 2.8 and not any(known.armed for _, known in view.recent)
    return off and now_s - view.flown.accepted_s > 6.0


@never(_TRUTH, "PX4 COM_OF_LOSS_T, ArduPilot FS_GCS_ENABLE")
def a_return_of_its_own(truth: Truth, view: View, now_s: float) -> bool:
    """A vehicle that nobody else touched does not return because of what we do."""
    craft = view.craft
    alone = view.taken_s == view.trouble_s == view.served_s == -math.inf and not craft.onboard
    asked = any(isinstance(goal.request, ReturnRequest) for goal in view.goals.values())
    return alone and craft.battery == 1.0 and not asked and truth.mode in ("RTL", "AUTO.RTL")


@never(_TRUTH, "PX4 COM_OF_LOSS_T")
def a_return_after_a_goal(truth: Truth, view: View, now_s: float) -> bool:
    """A PX4 whose goal has just ended does not return, even if 0.75 s of what is sent are lost."""
    last = view.last
    if truth.mode != "AUTO.RTL" or view.mode_s != now_s or view.active is not None or last is None:
        return False
    well = (OutcomeCode.CANCELED, OutcomeCode.SUCCESS)
    ended_well = any(end.code in well for end in last.ends)
    usual = view.craft.battery == 1.0 and not view.craft.onboard
    asked = isinstance(last.request, ReturnRequest) or view.served_s > last.ended_s
    lost = view.troubled or view.trouble_s - view.trouble_before_s > 0.8
    quiet = view.calm(now_s, 5.0) or (not lost and now_s - view.taken_s > 10.0)
    return ended_well and usual and not asked and quiet and now_s - last.ended_s < 6.0


# --- traffic ---------------------------------------------------------------------------------


def _begins_circle(entry: Entry, view: View) -> float | None:
    return entry.time_s if entry.kind == "truth" and view.circled_s == entry.time_s else None


@within(lambda view: 10.0, _begins_circle, "docs/fleet.md")
def a_wait_circle_ends(view: View, key: float, begun_s: float, now_s: float) -> bool:
    """Vehicles that wait for each other in a circle end it within 10 s once all servers run."""
    return view.circled_s > begun_s


# --- the server ------------------------------------------------------------------------------


@never(of_kind("server"), OURS)
def an_exception(what: str, view: View, now_s: float) -> bool:
    """Nothing raises."""
    return what == "failed"


@always(of_kind("size"), OURS)
def memory_is_bounded(size: tuple[str, int], view: View, now_s: float) -> bool:
    """No list, queue or table of the server has more than 5,000 entries."""
    return size[1] <= 5000


@always(of_kind("recorded"), "docs/logs.md")
def recordings_are_true(ends: dict[str, tuple[str, str]], view: View, now_s: float) -> bool:
    """A recording has the ends of goals that were published."""
    goals = [goal for goal in view.goals.values() if goal.ends]
    told = {goal.goal_id: (goal.ends[0].code.value, goal.ends[0].message) for goal in goals}
    return all(ends.get(goal_id) == end for goal_id, end in told.items())


@always(output(LogLine), OURS)
def log_lines_are_sentences(line: LogLine, view: View, now_s: float) -> bool:
    """No log line is empty, a traceback, or shows None or nan, but one that rejects it."""
    if line.text.startswith("A velocity command cannot be used: "):
        return True
    if "every number must be finite" in line.text:
        return True
    words = line.text.replace(".", " ").replace(",", " ").split()
    return bool(words) and not {"Traceback", "None", "nan"} & set(words)


@always(output(ServiceDone), "std_srvs/Trigger")
def services_say_why(done: ServiceDone, view: View, now_s: float) -> bool:
    """A service's answer is a sentence."""
    return done.message.endswith(".")


@never(output(ServiceDone), "docs/navigate.md, services")
def a_service_beside_a_goal(done: ServiceDone, view: View, now_s: float) -> bool:
    """No service but hold succeeds at once while a goal is active."""
    return done.success and view.active is not None and view.served_s == now_s


def _called_beside_a_goal(entry: Entry, view: View) -> float | None:
    beside = happens("serve", entry) and view.active and entry.value.how["service"] != "hold"
    return entry.time_s if beside else None


@within(lambda view: 0.5, _called_beside_a_goal, OURS)
def services_are_refused_at_once(view: View, key: float, begun_s: float, now_s: float) -> bool:
    """A service that cannot be done beside a goal is answered at once."""
    return view.answered_s >= begun_s or view.server_s > begun_s or not view.server


def _served(entry: Entry, view: View) -> float | None:
    return entry.time_s if happens("serve", entry) and view.server else None


@within(lambda view: 40.0, _served, OURS)
def services_answer(view: View, key: float, begun_s: float, now_s: float) -> bool:
    """A service is answered within 40 s."""
    restarted = view.server_s > begun_s or not view.server
    return view.answered_s >= begun_s or restarted or view.stalled_until_s > begun_s


@always(output(PlanChanged), "nav_msgs/Path")
def paths_are_finite(plan: PlanChanged, view: View, now_s: float) -> bool:
    """A planned path has finite points."""
    return all(_finite(*point) for point in plan.path_enu_m)


@always(output(PlanChanged), OURS)
def paths_end_with_goals(plan: PlanChanged, view: View, now_s: float) -> bool:
    """Without a goal no path is shown."""
    return not plan.path_enu_m or view.active is not None


def _led_through(entry: Entry, view: View) -> int | None:
    """Return which post stands on the rest of the path, near enough to be seen for sure."""
    if entry.kind != "truth" or not view.path_enu_m or not _avoids(view) or not view.copter:
        return None
    here = view.truth.position_enu_m
    moves = not view.truth.on_ground and not _stands(view, 0.5)
    if not moves or view.craft.sensor or not _ours(view, entry.time_s):
        return None
    nearest = min(range(len(view.path_enu_m)), key=lambda i: math.dist(view.path_enu_m[i], here))
    rest = (here, *view.path_enu_m[nearest + 1 :])
    for number, post in enumerate(view.posts):
        away_m = math.dist(post.at_enu_m, here[:2]) - post.radius_m
        if away_m > _SEEN_M or post.height_m < here[2] + 3.0:
            continue
        gaps_m = [_from_line_m(a, b, post.at_enu_m) for a, b in _legs(rest)]
        if min(gaps_m, default=math.inf) < post.radius_m:
            return number
    return None


def _legs(points: Sequence[Sequence[float]]) -> list[tuple[Sequence[float], Sequence[float]]]:
    return [(a[:2], b[:2]) for a, b in pairwise(points)]


@within(lambda view: 1.5 + 2.0 * view.craft.search_s, _led_through, "docs/obstacles.md")
def a_path_is_changed_for_what_is_seen(
    view: View, number: int, begun_s: float, now_s: float
) -> bool:
    """A path that leads through what stands within 5 m is changed soon."""
    over = view.active is None or view.active.accepted_s > begun_s or not view.path_enu_m
    over = over or view.path_s > begun_s or not view.calm(now_s, 10.0) or view.truth.collided
    feedback = view.flown.feedback
    return over or (feedback is not None and feedback.status is not Status.NAVIGATING)


def _shows_path_at_end(entry: Entry, view: View) -> str | None:
    end = _END(entry)
    return None if end is None else end.goal_id


@within(lambda view: 0.5, _shows_path_at_end, OURS)
def paths_go_with_goals(view: View, goal_id: str, begun_s: float, now_s: float) -> bool:
    """The path of a goal that has ended is taken away."""
    return not view.path_enu_m or view.active is not None or view.server_s > begun_s


_PAYLOAD_ENDED = Select("payload", lambda v: v if isinstance(v, PayloadEnded) else None)


def _payload_number(entry: Entry, view: View) -> int | None:
    return entry.value.number if isinstance(entry.value, PayloadAsked) else None


@within(lambda view: 30.0, _payload_number, "PointGimbal.action, TakePhoto")
def payload_requests_are_answered(view: View, number: int, begun_s: float, now_s: float) -> bool:
    """A client's request to the gimbal or the camera is answered within 30 s."""
    restarted = view.server_s > begun_s or not view.server
    return number in view.payload_ends or restarted or view.stalled_until_s > begun_s


@always(_PAYLOAD_ENDED, OURS)
def payload_requests_end_once(end: PayloadEnded, view: View, now_s: float) -> bool:
    """A request to the gimbal or the camera is answered once, with a sentence."""
    return view.payload_ends[end.number] == 1 and end.message.endswith(".")


@never(_PAYLOAD_ENDED, OURS)
def a_device_that_is_not_there(end: PayloadEnded, view: View, now_s: float) -> bool:
    """Nothing succeeds by a gimbal or a camera that the vehicle has not."""
    has = view.craft.camera if end.what == "photo" else view.craft.gimbal
    return end.code is OutcomeCode.SUCCESS and not has


POLICIES = policies()

ON_TRIAL = frozenset(
    {
        *("a_flight_away", "a_mishap_of_a_first_goal", "relative_targets_are_near"),
        *("setpoints_flow", "setpoints_keep_the_goals_speed", "a_wait_circle_ends"),
        *("all_laps_are_flown", "a_circle_is_kept"),
        *("a_goal_ends_by_required_acts_alone", "holds_are_held", "mission_items_have_their_holds"),
        *("a_success_without_the_target", "an_approach_within_the_least_distance"),
        *("a_landing_beside_the_mark", "a_touchdown_without_the_mark"),
        *("the_lateral_error_is_true", "a_route_turns_at_its_rate"),
        *("a_course_stays_in_the_volume", "taken_from_a_pilot"),
        *("a_success_on_contradictory_reports", "a_goal_accepted_on_contradictory_reports"),
        *("a_landing_by_a_lie", "a_meeting_because_of_another"),
        *("payload_requests_are_answered", "payload_requests_end_once"),
        *("a_device_that_is_not_there", "a_station_resumes_the_goal"),
        *("a_station_pause_is_reported", "a_passage_not_found"),
        *("a_goal_stops_outside_the_volume", "a_vehicle_without_positions_stops"),
        *("a_disarmed_vehicle_ends_its_goal", "an_unheard_command_is_sent_again"),
        *("passed_waypoints_were_passed", "moving_without_commands"),
        *("a_plane_gone_without_commands", "the_fence_left"),
        *("an_intruder_too_near", "a_goal_accepted_on_an_old_position", "a_restart_is_named"),
        *("a_path_is_changed_for_what_is_seen", "nothing_is_left_with_a_velocity"),
        *("a_return_after_a_goal", "arrived_is_within_the_radius"),
    }
)
"""New or changed: their violations are reported, but fail nothing until they have judged a thousand
seeds rightly."""
