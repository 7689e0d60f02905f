"""A page's messages: checked, allowed, passed on and answered. No ROS, no I/O, no clock."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import Protocol

from drone_navigation.console import plans
from drone_navigation.console.lease import Leases
from drone_navigation.console.messages import (
    Alive,
    Cancel,
    ConvertMission,
    Give,
    Hold,
    PageCommand,
    PageFollow,
    PageGoal,
    PagePhoto,
    PagePoint,
    PlanSurvey,
    RateLimit,
    ReadPlan,
    Rehearse,
    RehearseTogether,
    RejectedError,
    Replay,
    SavePlan,
    Take,
    VehicleMessage,
    parse,
)
from drone_navigation.console.page_types import Tell
from drone_navigation.console.shown_values import ShownValues

__all__ = ["Page", "Pilots", "Rules"]

_RATE_HZ = 20.0
_BURST = 60.0


class Pilots(Protocol):
    """The interface that moves vehicles: `fleet.Fleet`."""

    def prepare(self, vehicle: str) -> None:
        """Find the services of a vehicle."""

    def hold(self, vehicle: str, answer: Callable[[bool, str], None]) -> None:
        """End the goal and hold."""

    def cancel(self, vehicle: str, answer: Callable[[bool, str], None]) -> None:
        """Cancel all goals."""

    def command(self, command: PageCommand, by: str, answer: Callable[[bool, str], None]) -> None:
        """Execute a command."""

    def fly(
        self, order: PageGoal | PageFollow, by: str, answer: Callable[[bool, str], None]
    ) -> None:
        """Send a goal, a route, or a target to follow."""

    def payload(self, asked: PagePhoto | PagePoint, answer: Callable[[bool, str], None]) -> None:
        """Take a photo, or point the gimbal."""

    def survey(self, asked: PlanSurvey, tell: Tell, answer: Callable[[bool, str], None]) -> None:
        """Compute lines over an area, which moves nothing."""

    def rehearse(self, order: Rehearse, by: str, tell: Tell) -> None:
        """Simulate how a goal or a route would go."""

    def rehearse_together(self, order: RehearseTogether, by: str, tell: Tell) -> None:
        """Simulate how goals and routes of several vehicles would go."""

    def replay(self, replay: Replay, answer: Callable[[bool, str], None]) -> None:
        """Play a recording."""


class Page:
    """An open page."""

    def __init__(self, number: int, tell: Tell, now: float) -> None:
        """Prepare.

        Args:
            number: counted from 1.
            tell: sends it a message; may be called from any thread.
            now: time, s.
        """
        self.number = number
        self.tell = tell
        self.rate_limit = RateLimit(_RATE_HZ, _BURST, now)

    @property
    def name(self) -> str:
        """For people."""
        return f"page {self.number}"


class Rules:
    """All pages, and what they may do."""

    def __init__(self, pilots: Pilots, board: ShownValues) -> None:
        """Prepare.

        Args:
            pilots: what moves the vehicles.
            board: what is known of them.
        """
        self._pilots = pilots
        self._board = board
        self.leases = Leases()
        self.rejected: Counter[str] = Counter()

    def take(self, page: Page, data: str | bytes, now: float) -> None:
        """Act on what a page sent, at a time in s."""
        try:
            message = parse(data)
        except RejectedError as error:
            self.reject("message")
            # One that floods is not answered: the flood would be as large.
            if page.rate_limit.allows(now):
                _answer_to(page, "")(False, f"Rejected: {error}")
            return
        # Messages that end a flight are never too many.
        if not isinstance(message, (Hold, Cancel)) and not page.rate_limit.allows(now):
            self.reject("rate")
            return
        self.leases.hear(page.number, now)
        if isinstance(message, Alive):
            return
        if isinstance(message, RehearseTogether):
            vehicles = {route.vehicle for route in message.routes}
        else:
            vehicles = {message.vehicle}
        if not vehicles <= set(self._board.vehicles()):
            self._deny(page, "vehicle", "There is no such vehicle.")
        elif isinstance(message, RehearseTogether):
            self._pilots.rehearse_together(message, page.name, page.tell)
        elif isinstance(message, Rehearse):
            self._pilots.rehearse(message, page.name, page.tell)
        elif isinstance(message, PlanSurvey):
            answer = _answer_to(page, message.kind, message.vehicle)
            self._pilots.survey(message, page.tell, answer)
        else:
            self._act(page, message, now)

    def reject(self, kind: str) -> None:
        """Count a request that was rejected."""
        self.rejected[kind] += 1

    def close(self, page: Page, now: float) -> None:
        """Note that a page has gone, at a time in s."""
        self.leases.give(page.number)
        self.leases.expire(now)

    def _deny(self, page: Page, kind: str, sentence: str) -> None:
        self.reject(kind)
        _answer_to(page, "")(False, f"Rejected: {sentence}")

    def _act(self, page: Page, message: VehicleMessage, now: float) -> None:
        answer = _answer_to(page, message.kind, message.vehicle)
        if isinstance(message, Hold):
            self._pilots.hold(message.vehicle, answer)
        elif isinstance(message, Cancel):
            self._pilots.cancel(message.vehicle, answer)
        elif isinstance(message, Replay):
            self._pilots.replay(message, answer)
        elif isinstance(message, Take):
            self._take_control(page, message, now)
        elif isinstance(message, Give):
            self.leases.give(page.number, message.vehicle)
        elif isinstance(message, (ReadPlan, SavePlan, ConvertMission)):
            self._convert(page, message)
        else:
            self._order(page, message, answer, now)

    def _order(
        self,
        page: Page,
        message: VehicleMessage,
        answer: Callable[[bool, str], None],
        now: float,
    ) -> None:
        """Pass on what only the page with control may have done."""
        if not self.leases.holds(message.vehicle, page.number, now):
            self._deny(page, "control", "This page does not have control.")
        elif isinstance(message, PageCommand):
            self._pilots.command(message, page.name, answer)
        elif isinstance(message, (PagePhoto, PagePoint)):
            self._pilots.payload(message, answer)
        elif isinstance(message, (PageGoal, PageFollow)):
            self._pilots.fly(message, page.name, answer)

    def _take_control(self, page: Page, message: Take, now: float) -> None:
        if self.leases.take(message.vehicle, page.number, now, over=message.over):
            self._pilots.prepare(message.vehicle)
        else:
            self._deny(page, "control", "Another page has control of this vehicle.")

    def _convert(self, page: Page, message: ReadPlan | SavePlan | ConvertMission) -> None:
        status = self._board.get(message.vehicle, "status") or {}
        known = (status.get("autopilot", ""), self._board.get(message.vehicle, "home"))
        try:
            if isinstance(message, SavePlan):
                text = plans.make_plan(message.waypoints, *known)
            elif isinstance(message, ConvertMission):
                get = partial(self._board.get, message.vehicle)
                stored = (get("mission"), get("fence"), get("rally_points"))
                text = plans.stored_plan(*stored, *known)
            else:
                text = message.text
            if isinstance(message, ReadPlan) or (
                isinstance(message, ConvertMission) and message.form == "route"
            ):
                waypoints, notes = plans.map_waypoints(text, *known)
                page.tell({"type": "plan", "waypoints": waypoints, "notes": notes})
            else:
                page.tell({"type": "plan_file", "text": text})
        except plans.PlanError as error:
            _answer_to(page, "")(False, f"The plan: {error}")


def _answer_to(page: Page, kind: str, vehicle: str = "") -> Callable[[bool, str], None]:
    """Return what sends an answer to a message of a kind, "" for one that was rejected."""

    def answer(success: bool, text: str) -> None:
        about = {"to": kind, "vehicle": vehicle}
        page.tell({"type": "answer", **about, "success": success, "text": text})

    return answer
