"""Goals sent by a navigation client, the current one and their results."""

from __future__ import annotations

import time

from rclpy.action import ActionClient
from rclpy.node import Node

from custom_interfaces.action import Navigate
from custom_interfaces.msg import GoalEvent
from drone_navigation.client.client_goal import ClientGoal
from drone_navigation.client.events import (
    Accepted,
    Ended,
    Event,
    Rejected,
    Said,
    Sending,
    Telemetry,
)
from drone_navigation.client.goals import GoalStage, SentGoal
from drone_navigation.client.options import (
    EXIT_ABORTED,
    EXIT_CANCELED,
    EXIT_NO_SERVER,
    EXIT_REJECTED,
    EXIT_SUCCESS,
)
from drone_navigation.client.rejections import Rejections
from drone_navigation.client.terminal.output import ClientView
from drone_navigation.client.watch import LOST_TIMEOUT_S, ServerWatch
from drone_navigation.presence import Presence
from drone_navigation.qos import STREAM_QOS
from navigation_bridge.names import ACTION_NAME, SERVER_NODE_NAME

# The reason of a rejection comes on its own topic, usually before the rejection itself. A server
# that was too late to check the goal publishes it when it runs again.
_REASON_TIMEOUT_S = 5.0

_EXIT_CODES = {"SUCCEEDED": EXIT_SUCCESS, "CANCELED": EXIT_CANCELED, "ABORTED": EXIT_ABORTED}


class Course:
    """Sends goals in sequence; each replaces its predecessor.

    Attributes:
        code: exit code by the end of the last goal that has ended.
    """

    def __init__(
        self,
        node: Node,
        view: ClientView,
        first: ClientGoal,
        lost_timeout_s: float = LOST_TIMEOUT_S,
    ) -> None:
        """Prepare on ``node`` to send ``first`` and points after it.

        Args:
            node: the client's own.
            view: what shows it all.
            first: the first goal.
            lost_timeout_s: longest wait for a server that is not heard while a goal is flown.
        """
        self.code = EXIT_ABORTED
        self._view = view
        kinds: dict[str, type[object]] = {ACTION_NAME: Navigate, first.name: first.action}
        self._clients = {name: ActionClient(node, kind, name) for name, kind in kinds.items()}
        self._first = first
        self._rejections = Rejections(node)
        node.create_subscription(
            GoalEvent, f"{SERVER_NODE_NAME}/goal_events", self._on_goal_event, STREAM_QOS
        )
        self._presence = Presence(node)
        self._goals: list[SentGoal] = []
        self._sent = 0
        self._current = 0
        self._update_failed = False
        self._accepted_s: float | None = None
        self._watch = ServerWatch(lost_timeout_s)

    # --- state ---------------------------------------------------------------------------

    @property
    def under_way(self) -> bool:
        """True while a goal has not ended."""
        return bool(self._goals)

    @property
    def unanswered(self) -> bool:
        """True while the server has neither accepted nor rejected a goal."""
        return any(goal.stage is not GoalStage.OPEN for goal in self._goals)

    @property
    def exit_code(self) -> int:
        """Exit code: the last goal's result, unless an earlier one was rejected."""
        failed = self._update_failed and self.code == EXIT_SUCCESS
        return EXIT_REJECTED if failed else self.code

    def t_s(self, now_s: float) -> float:
        """Return the time since the first goal was accepted; 0 before that."""
        return 0.0 if self._accepted_s is None else now_s - self._accepted_s

    def servers_are_known(self) -> bool:
        """True if all servers in the graph have reported."""
        return self._presence.alive >= self._presence.offered

    @property
    def servers(self) -> int:
        """Number of servers that report."""
        return self._presence.alive

    @property
    def several_servers(self) -> bool:
        """True if more than one server would accept a goal."""
        return self._presence.several

    def server_is_ready(self) -> bool:
        """True if the action of the first goal is available."""
        return bool(self._clients[self._first.name].server_is_ready())

    def why_lost(self, now_s: float) -> str:
        """Return why no result can be expected any more; empty otherwise."""
        return self._watch.verdict(now_s) if self._open else ""

    @property
    def _open(self) -> list[SentGoal]:
        return [goal for goal in self._goals if goal.stage is GoalStage.OPEN]

    # --- what to do ----------------------------------------------------------------------

    def say(self, text: str, *, bad: bool = False) -> None:
        """Show a remark."""
        self.tell(Said(text, bad))

    def numbered(self, text: str) -> str:
        """Replace goal ids in a sentence of the server by this client's numbers."""
        for goal in self._goals:
            text = text.replace(goal.id, str(goal.number))
        return text

    def tell(self, event: Event) -> None:
        """Show an event."""
        self._view.tell(event, self.t_s(time.monotonic()))

    def send(self, client_goal: ClientGoal, *, typed: bool = False) -> None:
        """Send a goal.

        Args:
            client_goal: the goal.
            typed: whether a person typed it in flight, and will see what becomes of it.
        """
        self._sent += 1
        self.tell(Sending(self._sent, client_goal.name, client_goal.description))
        client = self._clients[client_goal.name]
        now_s = time.monotonic()
        self._goals.append(
            SentGoal(self._sent, client_goal, client, self._on_feedback, now_s, typed=typed)
        )

    def cancel(self, now_s: float) -> None:
        """Cancel the active goals; called repeatedly until none is left."""
        for goal in self._goals:
            if goal.cancel(now_s):
                self.say("The server did not accept the cancel; retrying.", bad=True)

    def look(self, now_s: float) -> None:
        """Process answers of the server and their timeouts."""
        self._look_for_server(now_s)
        for goal in list(self._goals):
            if goal.look(now_s):
                self._on_stage(goal)
            if goal.stage is GoalStage.REFUSED:
                self._on_refused(goal, now_s)

    def _look_for_server(self, now_s: float) -> None:
        if not self._open:
            return
        if remark := self._watch.look(now_s, ready=self.server_is_ready()):
            self.say(remark, bad=True)
        if self._watch.asks_again(now_s):
            for goal in self._open:
                goal.ask_again()

    def _hear(self, now_s: float) -> None:
        if remark := self._watch.hear(now_s):
            self.say(remark)

    def _on_stage(self, goal: SentGoal) -> None:
        if goal.stage is GoalStage.OPEN:
            self._current = goal.number
            self._hear(goal.since_s)
            if self._accepted_s is None:
                self._accepted_s = goal.since_s
            self.tell(Accepted(goal.number, goal.id))
        elif goal.stage is GoalStage.ENDED:
            self._hear(goal.since_s)
            self._goals.remove(goal)
            ended = goal.end(replaced=self._sent > goal.number)
            self._on_end(ended)
            self.tell(ended)
        elif goal.stage is GoalStage.FORGOTTEN:
            self._hear(goal.since_s)
            self._goals.remove(goal)
            self.code = EXIT_NO_SERVER
            self.say(
                f"The server no longer knows goal {goal.number}: it was restarted and did not "
                "resume the goal, or the goal ended more than five minutes ago.",
                bad=True,
            )
        elif goal.stage is GoalStage.UNANSWERED:
            self._goals.remove(goal)
            self._fail(goal, EXIT_NO_SERVER)
            self.say("The server did not answer the goal request.", bad=True)

    def _on_end(self, ended: Ended) -> None:
        # The end of a goal that was replaced may be reported after the next one was accepted.
        if ended.goal >= self._current:
            self.code = _EXIT_CODES[ended.state]

    def _on_refused(self, goal: SentGoal, now_s: float) -> None:
        reason = self._rejections.of(goal.id)
        if reason is None and now_s < goal.since_s + _REASON_TIMEOUT_S:
            return
        self._goals.remove(goal)
        self._fail(goal, EXIT_REJECTED)
        if reason is None:
            self.tell(Rejected(goal.number, "", "no reason was published"))
        else:
            self.tell(Rejected(goal.number, reason.code, f"{reason.code}: {reason.sentence}"))

    def _fail(self, goal: SentGoal, code: int) -> None:
        if goal.number == 1:
            self.code = code
        elif not goal.typed:
            self._update_failed = True

    def _on_goal_event(self, happened: GoalEvent) -> None:
        if happened.event != GoalEvent.STATUS or not happened.message:
            return
        if any(goal.id == happened.goal_id for goal in self._goals):
            self.say(f"{happened.what}: {happened.message}", bad=True)

    def _on_feedback(self, goal: SentGoal, telemetry: Telemetry) -> None:
        now_s = time.monotonic()
        self._hear(now_s)
        if goal.number >= self._current and goal.stage in (GoalStage.SENT, GoalStage.OPEN):
            self._view.show(telemetry, self.t_s(now_s))
