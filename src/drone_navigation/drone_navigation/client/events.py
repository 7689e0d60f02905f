"""Events of the navigation client, as sentences for people and as objects for scripts."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from typing import ClassVar, TypeAlias

from navigation_core.geometry import Vector3


@dataclass(frozen=True)
class _Named:
    """The parts common to all events: the name in JSON, and whether it is something bad."""

    name: ClassVar[str]
    bad: ClassVar[bool] = False


@dataclass(frozen=True)
class Said:
    """A remark."""

    name: ClassVar[str] = "said"
    text: str
    bad: bool = False

    @property
    def sentence(self) -> str:
        """The remark."""
        return self.text


@dataclass(frozen=True)
class Sending(_Named):
    """A goal was sent.

    Attributes:
        goal: its number, counted from 1.
        action: name of the action.
        description: "goal (1, 2, 3) m in frame map".
    """

    name = "sending"
    goal: int
    action: str
    description: str

    @property
    def sentence(self) -> str:
        """For people."""
        return f"Sending {self.description}"


@dataclass(frozen=True)
class Accepted(_Named):
    """The server accepted a goal; ``id`` is the one in the server's messages."""

    name = "accepted"
    goal: int
    id: str

    @property
    def sentence(self) -> str:
        """For people."""
        return "Goal accepted" if self.goal == 1 else f"Goal {self.goal} accepted"


@dataclass(frozen=True)
class Rejected(_Named):
    """The server rejected a goal; ``message`` is "CODE: sentence", ``code`` may be empty."""

    name = "rejected"
    bad = True
    goal: int
    code: str
    message: str

    @property
    def sentence(self) -> str:
        """For people."""
        return f"Goal rejected: {self.message}"


@dataclass(frozen=True)
class Ended:
    """A goal has ended.

    Attributes:
        goal: its number.
        state: "SUCCEEDED", "CANCELED" or "ABORTED".
        code: what ``message`` begins with.
        message: "CODE: sentence".
        replaced: whether a later goal of this client took its place.
        position_enu_m: last position in frame map; NaN when unknown.
        elapsed_s: from acceptance to the end.
        error_m: distance to the target; NaN when unknown.
        waypoints_reached: of a route, all laps counted; None for a point.
        waypoints_missed: of a route, those passed outside their radius, from 0 over all laps; None
            for a point.
        next_index: of a route, the first waypoint that is left, from 0 over all laps; None for a
            point.
        route_id: of a route, its number; None for a point.
        laps_flown: of a circle; None for others.
    """

    name: ClassVar[str] = "ended"
    goal: int
    state: str
    code: str
    message: str
    replaced: bool
    position_enu_m: Vector3
    elapsed_s: float
    error_m: float = math.nan
    waypoints_reached: int | None = None
    waypoints_missed: tuple[int, ...] | None = None
    next_index: int | None = None
    route_id: int | None = None
    laps_flown: float | None = None

    @property
    def bad(self) -> bool:
        """True if the result is neither a success nor requested by the user."""
        return self.state == "ABORTED" and not self.replaced

    @property
    def sentence(self) -> str:
        """For people."""
        if self.replaced:
            # Its message contains only the id of the other goal.
            return f"Goal {self.goal} ended: {self.code} after {self.elapsed_s:.1f} s"
        x, y, z = self.position_enu_m
        place = f", at ({x:.2f}, {y:.2f}, {z:.2f}) m" if math.isfinite(x) else ""
        error = ""
        if self.state != "SUCCEEDED" and math.isfinite(self.error_m):  # a success says it itself
            error = f", {self.error_m:.2f} m from the target"
        rest = ""
        if self.state != "SUCCEEDED" and self.next_index and self.route_id:
            rest = f" The rest: --first {self.next_index + 1} --interrupted {self.route_id}."
        return f"{self.message} ({self.elapsed_s:.1f} s{place}{error}){rest}"


@dataclass(frozen=True)
class Exit(_Named):
    """The client exits with this code."""

    name = "exit"
    code: int

    @property
    def sentence(self) -> str:
        """Empty: the result has been shown."""
        return ""


Event: TypeAlias = Said | Sending | Accepted | Rejected | Ended | Exit


@dataclass(frozen=True)
class Telemetry:
    """One feedback in display units.

    Attributes:
        goal: number of the goal, counted from 1.
        status: the server's ``current_status``.
        position_enu_m: position in the map frame; NaN when unknown.
        distance_left_m: along the planned path.
        time_left_s: by the trajectory being flown.
        battery_percent: 0 to 100; NaN when unknown.
        replans: number of replans because of obstacles.
        waypoint: of a route, the current one, counted from 1; None for a point.
        waypoints: how many the route has; None for a point.
        lap: of a route, counted from 1; None for a point.
        setpoint_delay_s: how late the server was in the last seconds.
        laps_flown: of a circle; None for others.
        radius_error_m: of a circle, the distance to the centre minus the radius; NaN while it is
            not flown, None for others.
        follow_state: of a target, "ACQUIRING", "FOLLOWING" or "LOST"; None for others.
        target_distance_m: of a target, the distance to it; NaN when unknown, None for others.
        target_age_s: of a target, the time since it was measured; None for others.
    """

    name: ClassVar[str] = "feedback"
    goal: int
    status: str
    position_enu_m: Vector3
    distance_left_m: float
    time_left_s: float
    battery_percent: float
    replans: int = 0
    waypoint: int | None = None
    waypoints: int | None = None
    lap: int | None = None
    setpoint_delay_s: float = 0.0
    laps_flown: float | None = None
    radius_error_m: float | None = None
    follow_state: str | None = None
    target_distance_m: float | None = None
    target_age_s: float | None = None

    @property
    def follow_text(self) -> str:
        """How a target is followed, for people: "following, 7.2 m from the target"."""
        state, distance_m = (self.follow_state or "").lower(), self.target_distance_m
        if distance_m is None or not math.isfinite(distance_m):
            return state
        return f"{state}, {distance_m:.1f} m from the target"


def as_json(what: Event | Telemetry, t_s: float) -> str:
    """Return one line of JSON: ``event``, ``t_s``, and the fields; unknown fields are null.

    Args:
        what: an event or a feedback.
        t_s: seconds since the first goal was accepted.
    """
    members = {"event": what.name, "t_s": round(t_s, 3)} | asdict(what)
    return json.dumps({key: _plain(value) for key, value in members.items()}, allow_nan=False)


def _plain(value: object) -> object:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return [_plain(part) for part in value] if isinstance(value, tuple) else value
