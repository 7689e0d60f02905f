"""The acts at the waypoints of a flight: one after the other, and whether the vehicle may leave.

An act is ordered from the vehicle, which answers in its report; the next one begins then. Acts of a
waypoint that is flown through are done on the way; at a stop the vehicle stays until the last one
is done.
"""

from __future__ import annotations

from collections import deque

from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.inputs.waypoint_acts import (
    ActOrder,
    SetServo,
    UseGripper,
    WaitHere,
    WaypointAct,
)
from navigation_core.tasks.intents import Outcome, StopFirst
from navigation_core.tasks.observation import Observation

__all__ = ["ActQueue", "time_for"]

# The vehicle's answer takes no longer; without one the order was lost with the link.
_ANSWER_S = 20.0


def time_for(acts: tuple[WaypointAct, ...]) -> float:
    """Return how long acts take at most, in seconds."""
    return sum(each.act.time_s if isinstance(each.act, WaitHere) else _ANSWER_S for each in acts)


class ActQueue:
    """Does acts in their order.

    Attributes:
        order: the act that the vehicle is asked for now, or None.
        failed: acts that were not done, as "PHOTO at waypoint 3".
        stop_s: how long the acts of the next stop, or of the present one, take at most.
    """

    def __init__(self) -> None:
        """Begin empty."""
        self.order: ActOrder | None = None
        self.failed: list[str] = []
        self.stop_s = 0.0
        self._waiting: deque[tuple[str, WaypointAct]] = deque()
        self._current: tuple[str, WaypointAct] | None = None
        self._since_s = 0.0
        self._orders = 0
        self._ending: Outcome | None = None
        self._stop: int | None = None
        self._at_stop: tuple[tuple[str, WaypointAct], ...] = ()

    def add(self, number: str, acts: tuple[WaypointAct, ...], *, reached: bool) -> None:
        """Do the acts of a waypoint that is flown through.

        Args:
            number: of the waypoint, for people.
            acts: its acts.
            reached: whether it was passed within its radius; photos and the gimbal do not need
                that, but nothing is dropped elsewhere.
        """
        for act in acts:
            if not reached and isinstance(act.act, UseGripper | SetServo):
                self._fail(number, act, "its waypoint was passed outside its radius")
            else:
                self._waiting.append((number, act))

    def expect_stop(self, index: int, number: str, acts: tuple[WaypointAct, ...]) -> None:
        """Prepare the acts of the next stop, unless it is the one whose acts have begun."""
        if index != self._stop:
            self._stop = index
            self._at_stop = tuple((number, act) for act in acts)
            self.stop_s = time_for(acts)

    def holds_at_stop(self) -> bool:
        """Begin the acts of the stop that is reached; return whether some are left."""
        self._waiting.extend(self._at_stop)
        self._at_stop = ()
        return self.is_busy

    @property
    def is_busy(self) -> bool:
        """Whether acts are left, but those of a stop that is not reached yet."""
        return self._current is not None or bool(self._waiting)

    def step(self, observation: Observation, now: float) -> StopFirst | None:
        """Take the answer to an act, and begin the next; return the end for one that is required.

        Args:
            observation: what is known, with the vehicle's answer.
            now: time in seconds.
        """
        if self._current is not None:
            self._look(*self._current, observation, now)
        if self._ending is not None:
            return StopFirst(self._ending)
        if self._current is None and self._waiting:
            self._begin(now)
        return None

    def give_up(self) -> None:
        """Do nothing more: the flight is being ended."""
        self.order = self._current = None
        self._waiting.clear()
        self._at_stop = ()

    def _begin(self, now: float) -> None:
        self._current = self._waiting.popleft()
        self._since_s = now
        act = self._current[1].act
        if not isinstance(act, WaitHere):
            self._orders += 1
            self.order = ActOrder(self._orders, act)

    def _look(self, number: str, act: WaypointAct, observation: Observation, now: float) -> None:
        elapsed_s = now - self._since_s
        if isinstance(act.act, WaitHere):
            if elapsed_s >= act.act.time_s:
                self._current = None
            return
        report, order = observation.act, self.order
        failure = f"no answer within {_ANSWER_S:g} s"
        if report is not None and order is not None and report.number == order.number:
            failure = report.failure
        elif elapsed_s < _ANSWER_S:
            return
        self._current = self.order = None
        if failure:
            self._fail(number, act, failure)

    def _fail(self, number: str, act: WaypointAct, failure: str) -> None:
        what = f"{act.act.name} at waypoint {number}"
        self.failed.append(what)
        if act.required and self._ending is None:
            text = f"The vehicle did not do {what}, which is required: {failure}."
            self._ending = Outcome(OutcomeCode.ACT_FAILED, text, None)
