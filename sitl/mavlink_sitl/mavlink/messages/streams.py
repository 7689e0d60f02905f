"""The schedule of message streams. Times are integer microseconds, so rates are exact."""

from __future__ import annotations

NEVER_US = 2**62


class StreamSchedule:
    """Messages sent at intervals."""

    def __init__(self) -> None:
        """Nothing is sent."""
        self._interval_us: dict[int, int] = {}
        self._due_us: dict[int, int] = {}
        self._default_us: dict[int, int] = {}
        self.next_due_us = NEVER_US

    def set(self, message_id: int, interval_us: int, now_us: int) -> None:
        """Send a message every interval_us from now on."""
        self._interval_us[message_id] = interval_us
        self._due_us[message_id] = now_us + interval_us
        self.next_due_us = min(self._due_us.values())

    def set_default(self, message_id: int, interval_us: int | None, now_us: int) -> None:
        """The interval of the group that a message is in; None for none."""
        if interval_us is None:
            self._default_us.pop(message_id, None)
        else:
            self._default_us[message_id] = interval_us
        self.reset(message_id, now_us)

    def reset(self, message_id: int, now_us: int) -> None:
        """Send it at the interval of its group again."""
        if message_id in self._default_us:
            self.set(message_id, self._default_us[message_id], now_us)
        else:
            self.stop(message_id)

    def stop(self, message_id: int) -> None:
        """Send it no more."""
        self._interval_us.pop(message_id, None)
        self._due_us.pop(message_id, None)
        self.next_due_us = min(self._due_us.values(), default=NEVER_US)

    def stop_all(self, but: frozenset[int]) -> None:
        """Send no message any more but some."""
        for message_id in [each for each in self._due_us if each not in but]:
            self.stop(message_id)

    def interval_us(self, message_id: int) -> int:
        """The interval, or -1 for a message that is not sent."""
        return self._interval_us.get(message_id, -1)

    def take_due(self, now_us: int) -> list[int]:
        """The messages that are due by now, each once, and the next time for each."""
        due = []
        for message_id, due_us in self._due_us.items():
            if due_us <= now_us:
                due.append(message_id)
                interval_us = self._interval_us[message_id]
                # Missed times are not made up for: a link needs news, not history.
                missed = (now_us - due_us) // interval_us
                self._due_us[message_id] = due_us + interval_us * (missed + 1)
        self.next_due_us = min(self._due_us.values(), default=NEVER_US)
        return due
