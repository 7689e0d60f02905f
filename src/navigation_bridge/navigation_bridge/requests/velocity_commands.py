"""Velocity commands of clients, and which of them may start a goal. No ROS.

A client that publishes velocities often publishes them all the time. So only a client that begins
to steer starts a goal: by the first command that is not zero after zeros or silence. And never
against somebody else: not while the vehicle is in a mode that the server did not choose, and not
after a goal that was ended by anything but the end of its commands.
"""

from __future__ import annotations

import math

from navigation_core.geometry import is_finite
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.velocity_command import VelocityCommand

__all__ = ["VelocityCommands", "check_command"]

# Least time between two log lines about commands that are not followed.
_TOLD_S = 5.0
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


class VelocityCommands:
    """Keeps the last command of a vehicle's clients."""

    def __init__(self) -> None:
        """Begin without a command."""
        self.current: VelocityCommand | None = None
        """The last command; None before the first, and after one that cannot be used."""
        self._heard_s = -math.inf
        self._is_fresh = True
        self._locked = False
        self._is_ours = False
        self._told_s = -math.inf

    def take(self, command: VelocityCommand, timeout_s: float) -> str:
        """Keep a command; return why it cannot be used, or an empty text.

        A command that cannot be used stops the vehicle, since what was meant is not known.
        """
        if command.time_s - self._heard_s > timeout_s:
            self._is_fresh = True
        self._heard_s = command.time_s
        fault = check_command(command)
        self.current = None if fault else command
        if not fault and command.is_zero:
            self._is_fresh = True
        return fault

    def drop(self) -> None:
        """Forget the last command: another came that cannot be used."""
        self.current = None

    def starts_goal(self, active_goal: str, in_control: bool, may_start: bool) -> tuple[bool, str]:
        """Decide whether the last command starts a goal.

        Args:
            active_goal: what is active and follows no commands; empty without a goal.
            in_control: whether the vehicle is in the mode in which it follows setpoints.
            may_start: whether commands may start goals at all.

        Returns:
            Whether it does; and if not, the reason, empty for a command to stand still.
        """
        command, was_fresh = self.current, self._is_fresh
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

    def goal_ended(self, code: OutcomeCode) -> None:
        """Process the end of a goal that followed commands."""
        self._locked = code not in _COMMANDS_ENDED

    def give_vehicle_away(self) -> None:
        """Process an act of a ground station that flies the vehicle itself."""
        self._locked = True

    def lose_vehicle(self) -> None:
        """Process a mode change that the server did not ask for, or a restart."""
        self._is_ours = False

    def is_to_tell(self, now: float) -> bool:
        """Whether a command that is not followed is to be logged now."""
        if now - self._told_s < _TOLD_S:
            return False
        self._told_s = now
        return True
