"""Goals, plans and progress, restored from the server's notes in a recording."""

from __future__ import annotations

from dataclasses import dataclass, field

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.state.status_text import StatusTexts, add_chunk, expire
from navigation_bridge import notes
from navigation_bridge.notes import NotedEvent
from navigation_core.geometry import Vector3


@dataclass
class RecordedGoal:
    """A recorded goal and its result. Times are those passed to the reader.

    Attributes:
        goal_id: UUID as hexadecimal digits; of old recordings the first eight.
        targets_enu_m: the target, or the waypoints of a route; none if the vehicle decides.
        kind: name of the action; empty in old recordings, as is the description.
        description: description of the goal.
        accepted_s: time of acceptance.
        statuses: (time in s, status, reason or other remark) of each.
        ended_s: time of the end; None if not in the recording.
        code: code of its end; empty before.
        message: the full sentence; empty in old recordings.
        final_error_m: distance to the target at the end; None if unknown.
        elapsed_s: duration by the server's clock, or None.
        waypoints_reached: number of waypoints reached on a route.
        replans: number of replans because of obstacles.
    """

    goal_id: str
    targets_enu_m: tuple[Vector3, ...] = ()
    kind: str = ""
    description: str = ""
    accepted_s: float = 0.0
    statuses: list[tuple[float, str, str]] = field(default_factory=list)
    ended_s: float | None = None
    code: str = ""
    message: str = ""
    final_error_m: float | None = None
    elapsed_s: float | None = None
    waypoints_reached: int = 0
    replans: int = 0

    @property
    def short_id(self) -> str:
        """The first digits of its UUID."""
        return self.goal_id[:8]


@dataclass
class NotesReader:
    """Content of the server's notes about one vehicle, with the time (s) of each.

    Attributes:
        goals: accepted goals, in order.
        events: events of goals, including rejected ones; old recordings have none.
        plans: planned paths (ENU, m).
        replans: replans of the goal at that time.
        distance_m: remaining distance.
        time_left_s: estimated remaining time.
        counts: counts of the last feedback: "replans", and on a route "waypoint", "lap", ...
        figures: of the last feedback, by name: on a circle the laps flown and the radius error (m),
            beside a target its distance (m) and age (s).
        feedbacks: number of feedbacks.
        status: status of the goal, or its end.
        remarks: everything else: modes, acts of ground stations.
    """

    goals: list[RecordedGoal] = field(default_factory=list)
    events: list[tuple[float, NotedEvent]] = field(default_factory=list)
    plans: list[tuple[float, tuple[Vector3, ...]]] = field(default_factory=list)
    replans: list[tuple[float, int]] = field(default_factory=list)
    distance_m: list[tuple[float, float]] = field(default_factory=list)
    time_left_s: list[tuple[float, float]] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    figures: dict[str, float] = field(default_factory=dict)
    feedbacks: int = 0
    status: list[tuple[float, str]] = field(default_factory=list)
    remarks: list[tuple[float, str]] = field(default_factory=list)
    _points: tuple[Vector3, ...] = ()
    _texts: StatusTexts = field(default_factory=StatusTexts)

    def take(self, time_s: float, message: Message) -> None:
        """Process a message of the recorder."""
        if isinstance(message, mavlink.MAVLink_statustext_message):
            self._take_chunk(time_s, message)
        elif isinstance(message, mavlink.MAVLink_named_value_float_message):
            if message.name == "dist_rem":
                self.distance_m.append((time_s, message.value))
            elif message.name == "time_rem":
                self.time_left_s.append((time_s, message.value))
            elif message.name in ("laps", "radius_err", "target_m", "target_age"):
                self.figures[message.name] = message.value
        elif isinstance(message, mavlink.MAVLink_named_value_int_message):
            self._take_count(time_s, message.name, message.value)
        elif (part := notes.parse_plan(message)) is not None:
            self._points += part[0]
            if part[1]:
                self.plans.append((time_s, self._points))
                self._points = ()

    def _take_count(self, time_s: float, name: str, value: int) -> None:
        if name == "waypoint":
            self.counts = {}
        self.counts[name] = value
        if name != "replans":
            return
        self.feedbacks += 1
        self.replans.append((time_s, value))
        if self.goals:
            self.goals[-1].replans = value

    def _take_chunk(self, time_s: float, message: mavlink.MAVLink_statustext_message) -> None:
        before = self._texts.count
        self._texts = add_chunk(
            expire(self._texts, time_s),
            severity=message.severity,
            text=message.text,
            text_id=message.id,
            chunk=message.chunk_seq,
            sequence=message.get_seq(),
            now=time_s,
        )
        new = self._texts.count - before
        for text in self._texts.texts[-new:] if new else ():
            self._take_text(time_s, text.text)

    def _take_text(self, time_s: float, text: str) -> None:
        if (event := notes.parse_event(text)) is not None:
            self.events.append((time_s, event))
            self._take_event(time_s, event)
        elif (target := notes.parse_goal(text)) is not None:
            self._take_target(time_s, *target)
        elif text.startswith("goal "):
            self._take_old_status(time_s, text)
        else:
            self.remarks.append((time_s, text))

    def _take_event(self, time_s: float, noted: NotedEvent) -> None:
        happened = noted.happened
        goal = self._goal(happened.goal_id)
        if happened.event == "ACCEPTED":
            self.counts, self.figures = {}, {}
            self.goals.append(
                RecordedGoal(
                    happened.goal_id,
                    kind=noted.kind,
                    description=happened.message,
                    accepted_s=time_s,
                )
            )
        elif happened.event == "STATUS":
            self._show(time_s, happened.what)
            if goal is not None:
                goal.statuses.append((time_s, happened.what, happened.message))
        elif happened.event == "ENDED":
            self._show(time_s, f"ended {happened.what}")
            if goal is not None:
                goal.ended_s, goal.code, goal.message = time_s, happened.what, happened.message
                goal.final_error_m, goal.elapsed_s = noted.final_error_m, noted.elapsed_s
                goal.waypoints_reached = noted.waypoints_reached

    def _take_target(self, time_s: float, short_id: str, target: Vector3) -> None:
        if not self.goals or self.goals[-1].short_id != short_id:
            self.goals.append(RecordedGoal(short_id, accepted_s=time_s))
        self.goals[-1].targets_enu_m += (target,)

    def _take_old_status(self, time_s: float, text: str) -> None:
        """Process notes of older versions: "goal ID STATUS", "goal ID ended CODE"."""
        _, short_id, *words = f"{text} ".split(" ")
        what = " ".join(words).strip()
        goal = self._goal(short_id)
        self._show(time_s, what)
        if goal is None:
            return
        if what.startswith("ended "):
            goal.ended_s, goal.code = time_s, what.removeprefix("ended ")
        else:
            goal.statuses.append((time_s, what, ""))

    def _goal(self, goal_id: str) -> RecordedGoal | None:
        return next((goal for goal in reversed(self.goals) if goal.goal_id == goal_id), None)

    def _show(self, time_s: float, status: str) -> None:
        if not self.status or self.status[-1][1] != status:
            self.status.append((time_s, status))
