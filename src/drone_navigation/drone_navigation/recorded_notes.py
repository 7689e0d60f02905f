"""What the server noted into a recording, put together again: goals, plans, progress."""

from __future__ import annotations

from dataclasses import dataclass, field

from drone_navigation import notes
from mavlink_vehicle.codec import Message
from navigation_core.geometry import Vector3


@dataclass(frozen=True)
class Goal:
    """Where a goal of the server leads.

    Attributes:
        short_id: the first digits of its UUID.
        targets_enu_m: the target, or the waypoints of a route.
    """

    short_id: str
    targets_enu_m: tuple[Vector3, ...]


@dataclass
class NotesReader:
    """What the server's notes said, with the time (s) of each."""

    goals: list[tuple[float, Goal]] = field(default_factory=list)
    plans: list[tuple[float, tuple[Vector3, ...]]] = field(default_factory=list)
    replans: list[tuple[float, int]] = field(default_factory=list)
    distance_m: list[tuple[float, float]] = field(default_factory=list)
    time_left_s: list[tuple[float, float]] = field(default_factory=list)
    status: list[tuple[float, str]] = field(default_factory=list)
    _points: tuple[Vector3, ...] = ()

    def take(self, time_s: float, message: Message) -> None:
        """Take in a message of the recorder."""
        kind = message.get_type()
        if kind == "STATUSTEXT":
            self._take_text(time_s, message.text)
        elif kind == "NAMED_VALUE_FLOAT" and message.name == "dist_rem":
            self.distance_m.append((time_s, message.value))
        elif kind == "NAMED_VALUE_FLOAT" and message.name == "time_rem":
            self.time_left_s.append((time_s, message.value))
        elif kind == "NAMED_VALUE_INT" and message.name == "replans":
            self.replans.append((time_s, message.value))
        elif (part := notes.parse_plan(message)) is not None:
            self._points += part[0]
            if part[1]:
                self.plans.append((time_s, self._points))
                self._points = ()

    def _take_text(self, time_s: float, text: str) -> None:
        parsed = notes.parse_goal(text)
        if parsed is None:
            words = text.split()
            # The goal's id is of no use in a picture.
            of_goal = words[:1] == ["goal"] and len(words) > 2
            self.status.append((time_s, " ".join(words[2:]) if of_goal else text))
            return
        short_id, target = parsed
        if self.goals and self.goals[-1][1].short_id == short_id:
            begun_s, goal = self.goals.pop()
            self.goals.append((begun_s, Goal(short_id, (*goal.targets_enu_m, target))))
        else:
            self.goals.append((time_s, Goal(short_id, (target,))))
