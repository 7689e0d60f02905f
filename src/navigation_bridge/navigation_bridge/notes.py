"""ROS-side events as MAVLink messages, written to the recording only.

A tlog holds the traffic of the link. Goals and their progress are not part of it, so the recorder
adds them as STATUSTEXT and NAMED_VALUE_FLOAT, from a separate component id that never sends on the
link (:data:`COMPONENT_ID`). Any tlog viewer shows them.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from mavlink_vehicle import codec
from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.state.status_text import CHUNK_SIZE
from navigation_bridge.goals.goal import GoalFinished, GoalHappened
from navigation_core.geometry import Vector3
from navigation_core.tasks.progress import FollowProgress, FollowState, Progress

# MAV_COMP_ID_ONBOARD_COMPUTER4 (common.xml): the recorder's own component id.
COMPONENT_ID = 194
_MAV_SEVERITY_INFO = 6
_PLAN = mavlink.MAVLink_debug_float_array_message
_FOLLOW_STATES = (FollowState.ACQUIRING, FollowState.FOLLOWING, FollowState.LOST)
_PLAN_NAME = b"plan"
_PLAN_POINTS = 19
_PLAN_POINTS_MAX = 95
_TEXT_IDS = 0xFFFF
# STATUSTEXT.chunk_seq is a uint8_t (common.xml).
_CHUNKS_MAX = 256
_EVENT = re.compile(
    r"goal (?P<id>[0-9a-f]+|-) (?P<event>ACCEPTED|REJECTED|STATUS|ENDED) (?P<what>\w+)"
    r"(?: after (?P<elapsed>[\d.]+) s)?(?:, (?P<error>[\d.]+) m off)?"
    r"(?:, (?P<reached>\d+) waypoints)?(?:, (?P<laps>[\d.e+-]+) laps)?"
    r"(?:, missed (?P<missed>[\d ]+))?(?:, next (?P<next>\d+) of route (?P<route>\d+))?"
    r":(?: (?P<message>.*))?"
)


def text(words: str) -> Message:
    """Return a STATUSTEXT of at most 50 bytes."""
    return codec.make(
        "STATUSTEXT", severity=_MAV_SEVERITY_INFO, text=words.encode("ascii", "replace")[:50]
    )


def long_text(words: str, text_id: int) -> list[Message]:
    """Return a text of any length as STATUSTEXTs, in chunks if necessary.

    Args:
        words: non-ASCII characters become "?"; what 256 chunks cannot hold is cut off.
        text_id: any number that differs from the previous text's.
    """
    data = words.encode("ascii", "replace")
    if len(data) >= _CHUNKS_MAX * CHUNK_SIZE:
        data = data[: _CHUNKS_MAX * CHUNK_SIZE - 4] + b"..."
    if len(data) < CHUNK_SIZE:
        return [text(words)]
    # The last chunk is never full, which marks it as the last.
    return [
        codec.make(
            "STATUSTEXT",
            severity=_MAV_SEVERITY_INFO,
            text=data[start : start + CHUNK_SIZE],
            id=text_id % _TEXT_IDS + 1,
            chunk_seq=number,
        )
        for number, start in enumerate(range(0, len(data) + 1, CHUNK_SIZE))
    ]


@dataclass(frozen=True)
class NotedEvent:
    """A recorded event of a goal.

    Attributes:
        happened: the event as observers received it.
        kind: for ACCEPTED, the name of the goal's action.
        elapsed_s: for ENDED, the time since the goal was accepted.
        final_error_m: for ENDED, the distance to the target; None if it could not be measured.
        waypoints_reached: for ENDED, of a route.
        waypoints_missed: for ENDED, of a route.
        next_index: for ENDED, of a route.
        route_id: for ENDED, of a route; 0 in older recordings.
        laps_flown: for ENDED, of a circle.
    """

    happened: GoalHappened
    kind: str = ""
    elapsed_s: float | None = None
    final_error_m: float | None = None
    waypoints_reached: int = 0
    waypoints_missed: tuple[int, ...] = ()
    next_index: int = 0
    route_id: int = 0
    laps_flown: float = 0.0


def event(happened: GoalHappened, kind: str = "", finished: GoalFinished | None = None) -> str:
    """Return an event of a goal as text; :func:`parse_event` reads it back.

    Args:
        happened: the event.
        kind: for ACCEPTED, the name of the goal's action.
        finished: for ENDED, the result.
    """
    words = f"goal {happened.goal_id or '-'} {happened.event} {happened.what or kind}"
    if finished is not None:
        words += f" after {finished.elapsed_s:.3f} s"
        if finished.final_error_m is not None:
            words += f", {finished.final_error_m:.3f} m off"
        if finished.waypoints_reached:
            words += f", {finished.waypoints_reached} waypoints"
        if finished.laps_flown:
            words += f", {finished.laps_flown:.4g} laps"
        if finished.waypoints_missed:
            words += f", missed {' '.join(map(str, finished.waypoints_missed))}"
        if finished.route_id:
            words += f", next {finished.next_index} of route {finished.route_id}"
    return f"{words}: {happened.message}".rstrip()


def parse_event(words: str) -> NotedEvent | None:
    """Return the event in a text made by :func:`event`, or None."""
    found = _EVENT.fullmatch(words)
    if found is None:
        return None
    accepted = found["event"] == "ACCEPTED"
    happened = GoalHappened(
        "" if found["id"] == "-" else found["id"],
        found["event"],
        "" if accepted else found["what"],
        found["message"] or "",
    )
    return NotedEvent(
        happened,
        found["what"] if accepted else "",
        _number(found["elapsed"]),
        _number(found["error"]),
        int(found["reached"] or 0),
        tuple(int(index) for index in (found["missed"] or "").split()),
        int(found["next"] or 0),
        int(found["route"] or 0),
        _number(found["laps"]) or 0.0,
    )


def _number(digits: str | None) -> float | None:
    try:
        return None if digits is None else float(digits)
    except ValueError:  # damaged
        return None


def goal_accepted(short_id: str, target_enu_m: Vector3) -> Message:
    """Return the note of an accepted goal, for :func:`parse_goal`.

    A route has one for each of its waypoints, in order.
    """
    x, y, z = target_enu_m
    return text(f"goal {short_id} to {x:.2f} {y:.2f} {z:.2f}")


def parse_goal(words: str) -> tuple[str, Vector3] | None:
    """Return (short id, target ENU in metres) of a note made by :func:`goal_accepted`."""
    parts = words.split()
    if len(parts) != 6 or parts[0] != "goal" or parts[2] != "to":
        return None
    try:
        return parts[1], (float(parts[3]), float(parts[4]), float(parts[5]))
    except ValueError:
        return None


def plan(path_enu_m: tuple[Vector3, ...]) -> list[Message]:
    """Return a planned path as DEBUG_FLOAT_ARRAYs, for :func:`parse_plan`.

    Each holds up to 19 points, east, north and up in metres; ``array_id`` is the number of arrays
    that follow. NaN fills the rest.
    """
    step = max(math.ceil(len(path_enu_m) / _PLAN_POINTS_MAX), 1)
    points = [*path_enu_m[:-1:step], *path_enu_m[-1:]]
    parts = [points[i : i + _PLAN_POINTS] for i in range(0, len(points), _PLAN_POINTS)]
    return [
        codec.make(
            "DEBUG_FLOAT_ARRAY",
            time_usec=0,
            name=_PLAN_NAME,
            array_id=left,
            data=[*itertools.chain(*part)] + [math.nan] * (58 - 3 * len(part)),
        )
        for left, part in zip(range(len(parts) - 1, -1, -1), parts, strict=True)
    ]


def parse_plan(message: Message) -> tuple[tuple[Vector3, ...], bool] | None:
    """Return the points (ENU, m) of a part of a plan, and whether it is the last part.

    Returns:
        None if the message is not one made by :func:`plan`.
    """
    if not isinstance(message, _PLAN) or message.name.encode() != _PLAN_NAME:
        return None
    numbers = [value for value in message.data if math.isfinite(value)]
    points = tuple(zip(numbers[::3], numbers[1::3], numbers[2::3], strict=False))
    return points, message.array_id == 0


def follow_progress(
    counts: Mapping[str, int], figures: Mapping[str, float]
) -> FollowProgress | None:
    """Return how a target is followed by the named values of a feedback; None without it."""
    number = counts.get("following", -1)
    if not 0 <= number < len(_FOLLOW_STATES) or not {"target_m", "target_age"} <= figures.keys():
        return None
    return FollowProgress(_FOLLOW_STATES[number], figures["target_m"], figures["target_age"])


def progress(state: Progress, now: float) -> list[Message]:
    """Return the content of a feedback as named values; "replans" is the last of each feedback.

    Remaining distance (m) and time (s); for a route the current waypoint, the lap, and the numbers
    of waypoints left and reached; for a circle the laps flown and the radius error (m); for a
    target its distance (m), its age (s) and the number of its state; then the number of replans.
    """
    boot_ms = int(now * 1000.0) & 0xFFFFFFFF
    figures: dict[str, float] = {
        "dist_rem": state.distance_remaining_m,
        "time_rem": state.time_remaining_s,
    }
    if (orbit := state.orbit) is not None:
        figures |= {"laps": orbit.laps_flown, "radius_err": orbit.radius_error_m}
    counts = {"replans": state.replans}
    if (follow := state.follow) is not None:
        figures |= {"target_m": follow.distance_m, "target_age": follow.age_s}
        counts = {"following": _FOLLOW_STATES.index(follow.state)} | counts
    if (route := state.route) is not None:
        counts = {
            "waypoint": route.current,
            "lap": route.lap,
            "left": route.remaining,
            "reached": route.reached,
        } | counts
    return [
        codec.make(f"NAMED_VALUE_{kind}", time_boot_ms=boot_ms, name=name.encode(), value=value)
        for kind, values in (("FLOAT", figures), ("INT", counts))
        for name, value in values.items()
    ]
