"""Goals of the server on behalf of Nav2's clients: one at a time, whichever action asked.

All runs in one thread, that of a single-threaded executor: each goal of a client is a coroutine
that looks at its goal of the server with every turn of the executor. A timer turns it while there
are such coroutines, so that none depends on being woken (see `server/actions.py` for what rclpy
does otherwise).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from rclpy.action import ActionClient
from rclpy.node import Node

from custom_interfaces.action import Follow, Navigate, NavigateWaypoints
from drone_navigation.client.client_goal import ClientGoal
from drone_navigation.client.events import Telemetry
from drone_navigation.client.goals import GoalStage, SentGoal
from drone_navigation.client.rejections import Rejections
from drone_navigation.client.servers import no_server
from drone_navigation.client.watch import ServerWatch
from drone_navigation.nav2.outcomes import PREEMPTED, Nav2Outcome, aborted, ended
from drone_navigation.nav2.server_state import ServerState
from drone_navigation.nav2.targets import Refusal
from drone_navigation.steady_timer import NextTurn, steady_timer
from navigation_bridge.names import (
    ACTION_NAME,
    FOLLOW_ACTION_NAME,
    WAYPOINTS_ACTION_NAME,
)

_PERIOD_S = 0.05
# The reason of a rejection comes on its own topic, usually before the rejection itself.
_REASON_TIMEOUT_S = 1.0
# A vehicle brakes for cancel_timeout_s (10 s) at most.
_STOP_TIMEOUT_S = 15.0
_LOST_TIMEOUT_S = 10.0
# The status, which names the active goal, comes once a second.
_ASK_AGAIN_S = 3.0


@dataclass
class FlightRequest:
    """A client's goal, as the server gets it.

    Attributes:
        client_goal: the server's goal.
        target_m: map z of its (last) target.
        is_cancelled: returns whether the client cancels it.
        on_telemetry: gets the feedback of the server.
        allowance_s: time after which it is stopped, 0 for none.
    """

    client_goal: ClientGoal
    target_m: float
    is_cancelled: Callable[[], bool]
    on_telemetry: Callable[[Telemetry], None] = lambda _telemetry: None
    allowance_s: float = 0.0


class Flights:
    """Sends goals to the server; each replaces its predecessor."""

    def __init__(self, node: Node, vehicle: ServerState) -> None:
        """Find the actions of the server.

        Args:
            node: whose executor has one thread.
            vehicle: the server's.
        """
        self._node = node
        self._vehicle = vehicle
        self._clients: dict[str, ActionClient] = {
            ACTION_NAME: ActionClient(node, Navigate, ACTION_NAME),
            FOLLOW_ACTION_NAME: ActionClient(node, Follow, FOLLOW_ACTION_NAME),
            WAYPOINTS_ACTION_NAME: ActionClient(node, NavigateWaypoints, WAYPOINTS_ACTION_NAME),
        }
        self._rejections = Rejections(node)
        self._timer = steady_timer(node, _PERIOD_S, lambda: None)
        self._timer.cancel()
        self._turning = 0
        self._sent = 0
        self._orders = 0
        self._goal: SentGoal | None = None
        self._stopping = False

    @property
    def is_idle(self) -> bool:
        """Whether no client's goal is in progress."""
        return self._turning == 0

    def stop(self) -> None:
        """Cancel what is under way; their clients see it aborted."""
        self._stopping = self._turning > 0

    async def fly(self, order: FlightRequest) -> Nav2Outcome:
        """Send a goal and follow it to its end, unless a newer one replaces it."""
        why = self._vehicle.why_not()
        if why is None and not self._clients[order.client_goal.name].server_is_ready():
            why = Refusal("NO_VEHICLE", no_server(self._node, order.client_goal.name))
        if why is not None:
            return aborted(*why)
        self._turning += 1
        self._timer.reset()
        try:
            return await self._fly(order)
        finally:
            self._turning -= 1
            if not self._turning:
                self._timer.cancel()
                self._stopping = False

    async def _fly(self, order: FlightRequest) -> Nav2Outcome:
        self._orders += 1
        own = self._orders
        before, self._goal = self._goal, None
        watch = ServerWatch(_LOST_TIMEOUT_S)
        started_s = time.monotonic()
        watch.hear(started_s)

        def hear(heard: SentGoal, telemetry: Telemetry) -> None:
            watch.hear(time.monotonic())
            # The last feedback may come after the result.
            if own == self._orders and heard.stage is GoalStage.OPEN:
                order.on_telemetry(telemetry)

        self._sent += 1
        client = self._clients[order.client_goal.name]
        goal = SentGoal(self._sent, order.client_goal, client, hear, started_s)
        self._goal = goal
        late = False
        while True:
            await NextTurn()
            now_s = time.monotonic()
            if own != self._orders:
                return PREEMPTED
            goal.look(now_s)
            if goal.stage is GoalStage.OPEN:
                self._vehicle.target_m = order.target_m
                late = late or 0.0 < order.allowance_s < now_s - started_s
                if late or self._stopping or order.is_cancelled():
                    goal.cancel(now_s)
                watch.look(now_s, ready=client.server_is_ready())
                if watch.asks_again(now_s) or self._is_forgotten(goal, now_s):
                    goal.ask_again()
                if lost := watch.verdict(now_s):
                    goal.cancel(now_s)
                    return aborted("NO_VEHICLE", lost)
            elif goal.stage is not GoalStage.SENT:
                break
        return await self._end(goal, before, order, late=late)

    def _is_forgotten(self, goal: SentGoal, now_s: float) -> bool:
        """Whether the server has another goal or none, so that the result may have been lost."""
        if now_s < goal.since_s + _ASK_AGAIN_S or self._vehicle.active_goal == goal.id:
            return False
        goal.since_s = now_s
        return True

    async def _end(
        self, goal: SentGoal, before: SentGoal | None, order: FlightRequest, *, late: bool
    ) -> Nav2Outcome:
        if goal.stage is GoalStage.ENDED:
            end = goal.end(replaced=False)
            if late and end.state == "CANCELED":
                return aborted(
                    "TIMEOUT", "Not done within the time allowance; the vehicle has stopped."
                )
            return ended(end, cancelled=order.is_cancelled())
        if goal.stage is GoalStage.REFUSED:
            until_s = goal.since_s + _REASON_TIMEOUT_S
            while self._rejections.of(goal.id) is None and time.monotonic() < until_s:
                await NextTurn()
            reason = self._rejections.of(goal.id) or ("INTERNAL_ERROR", "No reason given.")
            why = Refusal(*reason)
        elif goal.stage is GoalStage.FORGOTTEN:
            text = "The server was restarted and no longer knows the goal."
            why = Refusal("NO_VEHICLE", text)
        else:
            why = Refusal("NO_VEHICLE", "The server did not answer the goal request.")
        if before is not None:
            await self._halt(before)
        return aborted(*why)

    async def _halt(self, goal: SentGoal) -> None:
        """Stop a goal that was replaced, for its client, by one that the server rejects.

        The server itself continues its goal when it rejects another one.
        """
        until_s = time.monotonic() + _STOP_TIMEOUT_S
        while goal.stage in (GoalStage.SENT, GoalStage.OPEN) and time.monotonic() < until_s:
            now_s = time.monotonic()
            goal.look(now_s)
            goal.cancel(now_s)
            await NextTurn()
