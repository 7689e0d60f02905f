"""Sends a plane to a place, which it circles, or elsewhere while it has to give way."""

from __future__ import annotations

from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.conditions import Requester
from navigation_core.tasks.intents import Intent, Outcome, Perform, Wait
from navigation_core.tasks.observation import Observation, TaskOperation
from navigation_core.tasks.traits import Traits
from navigation_core.tasks.watching.plane_giving_way import PlaneGivingWay


class PlaneDestination:
    """The place that the plane was sent to last.

    Attributes:
        giving_way: the traffic that it gives way to.
        was_sent: whether it has taken any place, and no station has stopped it since.
    """

    def __init__(self, traits: Traits, requests: Requester) -> None:
        """Begin without a place; `requests` are the operations of the task."""
        self.giving_way = PlaneGivingWay(traits)
        self.was_sent = False
        self._requests = requests
        self._sent: tuple[Vector3, float | None] | None = None
        self._is_taken = False

    def forget(self) -> None:
        """Send it again: it was stopped in another mode."""
        self._sent = None
        self._is_taken = self.was_sent = False

    def send(
        self,
        place: Vector3,
        observation: Observation,
        now: float,
        circle_m: float | None = None,
        keeps_mode: bool = False,
    ) -> Intent | Outcome | None:
        """Have it fly to a place and circle it; None once it has taken that.

        As long as it has to give way, it is another place. `circle_m` is negative clockwise; None
        for its usual circle. With `keeps_mode` only the first place may change the mode.
        """
        self.giving_way.circle_m = circle_m
        place = self.giving_way.place(place, self._is_taken, observation, now)
        if (place, circle_m) != self._sent:
            self._sent, self._is_taken = (place, circle_m), False
            self._requests.forget()
        if self._is_taken:
            return None
        intent = Perform(
            TaskOperation.REPOSITION,
            target_enu_m=place,
            circle_m=circle_m,
            keeps_mode=keeps_mode and self.was_sent,
        )
        answer = self._requests.perform(intent, OutcomeCode.MODE_REFUSED, observation, now)
        if answer is None:
            self._is_taken = self.was_sent = True
            self._requests.forget()
        is_rejected = isinstance(answer, Outcome) and answer.code is OutcomeCode.MODE_REFUSED
        if is_rejected and self.giving_way.evades:
            self.giving_way.give_up(now)
            return Wait()
        return answer
