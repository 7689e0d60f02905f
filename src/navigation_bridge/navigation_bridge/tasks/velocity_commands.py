"""Velocity commands of clients, and which of them may start a goal. No ROS.

A client that publishes velocities often publishes them all the time. So only a client that begins
to steer starts a goal: by the first command that is not zero after zeros or silence. And never
against somebody else: not while the vehicle is in a mode that the server did not choose, and not
after a goal that was ended by anything but the end of its commands.
"""

from __future__ import annotations

import math

from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.goals.requests import VelocityRequest
from navigation_bridge.requests.feature import Feature, FeatureParts
from navigation_core.geometry import is_finite
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.inputs.velocity_command import VelocityCommand

__all__ = ["VelocityCommands", "check_command"]

# Least time between two log lines about commands that are not followed.
_LOG_PERIOD_S = 5.0
# The ends of a goal whose commands have ended.
_COMMANDS_ENDED = frozenset({OutcomeCode.SUCCESS, OutcomeCode.TIMEOUT})
_LOCKED = (
    "the vehicle was taken over, or the last follow_velocity goal did not end with its commands; "
    "send a goal first (follow_velocity)"
)


def check_command(command: VelocityCommand) -> str:
    """Return why a command cannot be used, as a sentence; empty if it can."""
    if is_finite(command.linear_m_s) and math.isfinite(command.yaw_rate_rad_s):
        return ""
    x, y, z = command.linear_m_s
    return (
        f"linear ({x:g}, {y:g}, {z:g}) m/s, angular.z {command.yaw_rate_rad_s:g} rad/s: every "
        "number must be finite."
    )


class VelocityCommands(Feature):
    """Keeps the last command of a vehicle's clients; logs those that are not followed."""

    def __init__(self, parts: FeatureParts) -> None:
        """Begin without a command."""
        super().__init__(parts)
        self._current: VelocityCommand | None = None
        self._heard_s = -math.inf
        self._is_fresh = True
        self._locked = False
        self._is_ours = False
        self._logged_s = -math.inf

    @property
    def timeout_s(self) -> float:
        """Age from which a command counts no more."""
        return self.parts.config().commands.timeout_s

    @property
    def command(self) -> VelocityCommand | None:
        """The last command; None before the first, and after one that cannot be used."""
        return self._current

    def follow(self, command: VelocityCommand, goal_id: str, now: float) -> None:
        """Process a velocity command of a client.

        It is followed by a goal that follows commands; without a goal it may start one.

        Args:
            command: the command; its numbers need not be finite.
            goal_id: UUID of the goal that it starts, if it does.
            now: time in seconds.
        """
        fault = self.keep(command, self.timeout_s)
        if fault:
            self._ignored(f"A velocity command cannot be used: {fault}", now)
            return
        goals, vehicle = self.parts.goals(), self.parts.vehicle
        goal = goals.active
        if goal is not None and goal.follows_commands:
            return
        active = "" if goal is None else f"goal {goal.short_id} ({goal.kind})"
        may_start = self.parts.config().commands.start_goal
        starts, why = self.starts_goal(active, vehicle.in_control_mode, may_start)
        if why:
            self._ignored(f"Velocity commands are ignored: {why}.", now)
        request = VelocityRequest()
        if starts and goals.check(request, now) is None:
            goals.start(goal_id, request, now)

    def reject(self, fault: str, now: float) -> None:
        """Process a velocity command that cannot be used; the vehicle stops.

        Args:
            fault: why, as a sentence.
            now: time in seconds.
        """
        self._current = None
        self._ignored(f"A velocity command cannot be used: {fault}", now)

    def _ignored(self, text: str, now: float) -> None:
        if self.takes_log_line(now):
            self.parts.report.log(LogLevel.WARN, text)

    def keep(self, command: VelocityCommand, timeout_s: float) -> str:
        """Keep a command; return why it cannot be used, or an empty text.

        A command that cannot be used stops the vehicle, since what was meant is not known.
        """
        if command.time_s - self._heard_s > timeout_s:
            self._is_fresh = True
        self._heard_s = command.time_s
        fault = check_command(command)
        self._current = None if fault else command
        if not fault and command.is_zero:
            self._is_fresh = True
        return fault

    def starts_goal(self, active_goal: str, in_control: bool, may_start: bool) -> tuple[bool, str]:
        """Decide whether the last command starts a goal.

        Args:
            active_goal: what is active and follows no commands; empty without a goal.
            in_control: whether the vehicle is in the mode in which it follows setpoints.
            may_start: whether commands may start goals at all.

        Returns:
            Whether it does; and if not, the reason, empty for a command to stand still.
        """
        command, was_fresh = self._current, self._is_fresh
        if command is None or command.is_zero:
            return False, ""
        self._is_fresh = False
        if active_goal:
            return False, f"{active_goal} is active"
        if not may_start:
            return False, "no follow_velocity goal is active, and cmd_vel_start is 'goal'"
        if self._locked:
            return False, _LOCKED
        if not in_control and not self._is_ours:
            return False, "the vehicle is in a mode that this server did not choose; send a goal"
        if not was_fresh:
            return False, "commands must have been zero or absent first"
        return True, ""

    def goal_began(self) -> None:
        """Process the start of any goal: its client has given the vehicle to the server."""
        self._locked, self._is_ours = False, True

    def goal_ended(self, goal: ActiveGoal, code: OutcomeCode) -> None:
        """Process the end of a goal that followed commands."""
        if goal.follows_commands:
            self.ended_with(code)

    def ended_with(self, code: OutcomeCode) -> None:
        """Let commands start another goal only if they have ended themselves."""
        self._locked = code not in _COMMANDS_ENDED

    def shut_down(self) -> None:
        """Let no command start another goal."""
        self._locked = True

    def give_vehicle_away(self) -> None:
        """Process an act of a ground station that flies the vehicle itself."""
        self._locked = True

    def lose_vehicle(self) -> None:
        """Process a mode change that the server did not ask for, or a restart."""
        self._is_ours = False

    def takes_log_line(self, now: float) -> bool:
        """Whether a command that is not followed is to be logged now."""
        if now - self._logged_s < _LOG_PERIOD_S:
            return False
        self._logged_s = now
        return True
