"""Goals run against a recording, with their results; nothing is sent. No ROS.

The goals go to a real bridge, which receives the recording. Nothing that it requests is sent, so
only what the recorded vehicle did anyway happens: a goal that needs GUIDED ends with its reason
where nobody selected GUIDED.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from mavlink_vehicle.codec import Codec
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import ServerConfig
from navigation_bridge.goals.goal import GoalFeedback, GoalFinished, GoalHappened
from navigation_bridge.recording.replay import Player
from navigation_bridge.recording.shadow_file import ShadowGoal

REJECTED, NOT_SENT, OPEN = "REJECTED", "NOT_SENT", "OPEN"
"""Results besides the codes of goals: rejected, after the end of the recording, and still open."""


@dataclass
class ShadowResult:
    """Result of a shadow goal. Times are seconds from the recording's beginning.

    Attributes:
        goal: the goal.
        feedback: (time, feedback) as a client would have received it.
        statuses: (time, status, reason or remark) of each.
        ended_s: time of the end; None if it did not end.
        end: the code of its end, or ``REJECTED``, ``NOT_SENT``, ``OPEN``.
        message: the sentence.
        final_error_m: distance to the target at the end, or None.
    """

    goal: ShadowGoal
    feedback: list[tuple[float, GoalFeedback]] = field(default_factory=list)
    statuses: list[tuple[float, str, str]] = field(default_factory=list)
    ended_s: float | None = None
    end: str = NOT_SENT
    message: str = ""
    final_error_m: float | None = None


def work_shadow_goals(
    records: Iterable[tuple[float, bytes]], config: ServerConfig, goals: Sequence[ShadowGoal]
) -> list[ShadowResult]:
    """Play a recording to a bridge and send it goals.

    Args:
        records: (unix time in seconds, packet), as ``TlogReader`` yields them.
        config: settings of the server.
        goals: goals, ordered by time.
    """
    return _Shadow(records, config, goals).run()


class _Shadow:
    def __init__(
        self,
        records: Iterable[tuple[float, bytes]],
        config: ServerConfig,
        goals: Sequence[ShadowGoal],
    ) -> None:
        self._bridge = Bridge(Vehicle(config.vehicle), config.bridge)
        component = config.vehicle.source_component
        codec = Codec(config.vehicle.source_system or 1, component)
        self._player = Player(records, self._bridge, codec, own_component=component)
        self._results = {f"{i:032x}": ShadowResult(goal) for i, goal in enumerate(goals, 1)}
        self._requests = sorted(self._deeds(), key=lambda deed: deed[0])

    def _deeds(self) -> Iterator[tuple[float, str, bool]]:
        """Yield (time, goal id, whether it is a cancel)."""
        for goal_id, result in self._results.items():
            yield result.goal.at_s, goal_id, False
            if result.goal.cancel_at_s is not None:
                yield result.goal.cancel_at_s, goal_id, True

    def run(self) -> list[ShadowResult]:
        """Play to the end."""
        player = self._player
        for at_s, group in itertools.groupby(self._requests, key=lambda deed: deed[0]):
            while (due_s := player.due_s()) is not None and due_s <= at_s:
                player.step()
                self._collect(player.now)
            if due_s is None:
                break
            for _, goal_id, cancel in group:
                self._request(goal_id, cancel, at_s)
        while not player.ended:
            player.step()
            self._collect(player.now)
        for result in self._results.values():
            self._close(result)
        return list(self._results.values())

    def _request(self, goal_id: str, cancel: bool, now: float) -> None:
        result = self._results[goal_id]
        if cancel:
            self._bridge.goals.cancel(goal_id, now)
        elif (rejection := self._bridge.goals.check(result.goal.request, now)) is not None:
            result.end, result.ended_s = REJECTED, now
            result.message = f"{rejection.code.value}: {rejection.message}"
        else:
            result.end = OPEN
            self._bridge.goals.start(goal_id, result.goal.request, now)
        self._bridge.messages_to_send()
        self._collect(now)

    def _collect(self, now: float) -> None:
        while (output := self._bridge.next_output()) is not None:
            if isinstance(output, GoalFeedback):
                self._results[output.goal_id].feedback.append((now, output))
            elif isinstance(output, GoalHappened) and output.event == "STATUS":
                status = (now, output.what, output.message)
                self._results[output.goal_id].statuses.append(status)
            elif isinstance(output, GoalFinished):
                result = self._results[output.goal_id]
                result.end, result.message = output.code.value, output.message
                result.ended_s, result.final_error_m = now, output.final_error_m

    def _close(self, result: ShadowResult) -> None:
        now = self._player.now
        if result.end == NOT_SENT:
            result.message = f"The recording ends after {now:.1f} s, before the goal was sent."
        elif result.end == OPEN:
            last = result.feedback[-1][1] if result.feedback else None
            where = "" if last is None else f", {last.distance_remaining_m:.1f} m away"
            status = result.statuses[-1][1] if result.statuses else "accepted"
            result.message = f"The recording ended while the goal was {status}{where}."
