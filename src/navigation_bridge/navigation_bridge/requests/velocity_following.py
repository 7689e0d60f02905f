"""Velocity commands of clients: a goal follows them, and some start one. No ROS."""

from __future__ import annotations

from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.goals.requests import VelocityRequest
from navigation_bridge.requests.feature import Feature, FeatureParts
from navigation_bridge.requests.velocity_commands import VelocityCommands
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.velocity_command import VelocityCommand

__all__ = ["VelocityFollowing"]


class VelocityFollowing(Feature):
    """Processes the commands; those that are not followed are logged."""

    def __init__(self, parts: FeatureParts) -> None:
        """Begin without a command."""
        super().__init__(parts)
        self._commands = VelocityCommands()

    @property
    def timeout_s(self) -> float:
        """Age from which a command counts no more."""
        return self.parts.config().commands.timeout_s

    @property
    def command(self) -> VelocityCommand | None:
        """The last command."""
        return self._commands.current

    def follow(self, command: VelocityCommand, goal_id: str, now: float) -> None:
        """Process a velocity command of a client.

        It is followed by a goal that follows commands; without a goal it may start one.

        Args:
            command: the command; its numbers need not be finite.
            goal_id: UUID of the goal that it starts, if it does.
            now: time in seconds.
        """
        fault = self._commands.take(command, self.timeout_s)
        if fault:
            self._ignored(f"A velocity command cannot be used: {fault}", now)
            return
        goals, vehicle = self.parts.goals, self.parts.vehicle
        goal = goals.active_goal
        if goal is not None and goal.follows_commands:
            return
        active = "" if goal is None else f"goal {goal.short_id} ({goal.kind})"
        may_start = self.parts.config().commands.start_goal
        starts, why = self._commands.starts_goal(active, vehicle.in_control_mode, may_start)
        if why:
            self._ignored(f"Velocity commands are ignored: {why}.", now)
        request = VelocityRequest()
        if starts and goals.check(request, now) is None:
            goals.start_goal(goal_id, request, now)

    def reject(self, fault: str, now: float) -> None:
        """Process a velocity command that cannot be used; the vehicle stops.

        Args:
            fault: why, as a sentence.
            now: time in seconds.
        """
        self._commands.drop()
        self._ignored(f"A velocity command cannot be used: {fault}", now)

    def _ignored(self, text: str, now: float) -> None:
        if self._commands.is_to_tell(now):
            self.parts.report.log(LogLevel.WARN, text)

    def goal_began(self) -> None:
        """Let commands start goals again."""
        self._commands.goal_began()

    def goal_ended(self, goal: ActiveGoal, code: OutcomeCode) -> None:
        """Process the end of a goal that followed commands."""
        if goal.follows_commands:
            self._commands.goal_ended(code)

    def give_vehicle_away(self) -> None:
        """Let no command start a goal against a ground station."""
        self._commands.give_vehicle_away()

    def lose_vehicle(self) -> None:
        """Let no command start a goal in a mode that somebody else chose."""
        self._commands.lose_vehicle()

    def shut_down(self) -> None:
        """Let no command start another goal."""
        self._commands.goal_ended(OutcomeCode.SHUTTING_DOWN)
