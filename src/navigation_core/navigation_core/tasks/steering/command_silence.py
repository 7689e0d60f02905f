"""The silence of velocity commands, and the end of a goal that follows them."""

from __future__ import annotations

from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.inputs.velocity_command import VelocityCommand
from navigation_core.tasks.intents import Outcome

__all__ = ["CommandSilence"]


class CommandSilence:
    """Knows which command counts, and when nobody commands any more."""

    def __init__(self, timeout_s: float, idle_s: float) -> None:
        """Prepare.

        Args:
            timeout_s: age from which a command counts no more.
            idle_s: silence after which a goal ends.
        """
        self._timeout_s, self._idle_s = timeout_s, idle_s
        self._command_s = 0.0  # of the last command that counted
        self._last: VelocityCommand | None = None

    def begin(self, now: float) -> None:
        """Count no time before this moment."""
        self._command_s = now

    def current(self, command: VelocityCommand | None, now: float) -> VelocityCommand | None:
        """Return the command, None if it is too old or there is none."""
        if command is None or now - command.time_s > self._timeout_s:
            return None
        self._last, self._command_s = command, max(self._command_s, command.time_s)
        return command

    def ended(self, now: float) -> Outcome | None:
        """Return the end of a goal that nobody sends commands to; the vehicle holds by then."""
        idle_s = self._idle_s
        if now - self._command_s <= idle_s:
            return None
        text = f"No velocity command has been received for {idle_s:g} s."
        if self._last is not None and self._last.is_zero:
            text = (
                f"The last velocity command was to stop; none has been received for {idle_s:g} s."
            )
            return Outcome(OutcomeCode.SUCCESS, text, None)
        return Outcome(OutcomeCode.TIMEOUT, text, None)
