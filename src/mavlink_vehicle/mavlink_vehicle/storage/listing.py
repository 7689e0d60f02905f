"""Reads all parameters: PARAM_REQUEST_LIST, then what was lost by its index.

https://mavlink.io/en/services/parameter.html. The autopilot sends the list once, as fast as the
link takes it. When it falls silent, what is missing is asked for, a few at a time: ArduPilot keeps
20 requests and drops others (GCS_Param.cpp). Values that nobody counts (index 65535: an echo of a
change, PX4's _HASH_CHECK) are no part of the list. Where the number of parameters changes under
way, as when PX4 first uses some, their indices are others, and everything is read again.
"""

from __future__ import annotations

from collections import deque

from mavlink_vehicle.codec import Message, make, mavlink
from mavlink_vehicle.events import OperationResult, Parameter, ParametersFinished
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.outbox import TimedOutbox
from mavlink_vehicle.storage.values import parameter_of

_VALUE = mavlink.MAVLink_param_value_message
_SILENCE_S = 1.0
_LISTS = 8
_AT_ONCE = 16
_ATTEMPTS = 12
_RESTARTS = 3
# Each is asked for 12 times; but a number of parameters that is not true would take hours.
_NOTHING_NEW_S = 20.0


class ParameterListing(TimedOutbox):
    """One reading of all parameters; ends in one `ParametersFinished`."""

    def __init__(self, address: Address, bytewise: bool) -> None:
        """Prepare; `start` sends.

        Args:
            address: who talks with whom.
            bytewise: whether integers stand in the float as their bytes.
        """
        super().__init__()
        self._address = address
        self._bytewise = bytewise
        self._found: dict[int, Parameter] = {}
        self._asked: dict[int, float] = {}
        self._attempts: dict[int, int] = {}
        self._lists = 0
        self._restarts = 0
        self._streams = True
        self._new_s = 0.0
        self.events: deque[ParametersFinished] = deque()
        self.total = 0
        """How many there are; 0 while that is unknown."""

    @property
    def received(self) -> int:
        """How many have been read."""
        return len(self._found)

    def start(self, now: float) -> None:
        """Ask for the list."""
        self._found.clear()
        self._asked.clear()
        self._attempts.clear()
        self._streams, self.total = True, 0
        self._lists += 1
        self._send("PARAM_REQUEST_LIST")
        self.deadline_s = now + _SILENCE_S

    def receive(self, message: Message, now: float) -> None:
        """Take a value."""
        if message.__class__ is not _VALUE or self.deadline_s is None:
            return
        index, count = message.param_index, message.param_count
        if index >= count:
            return
        if self.total and count != self.total:
            self._restart(now)
            return
        self.total = count
        if index not in self._found:
            self._new_s = now
        self._found[index] = parameter_of(message, self._bytewise)
        if self._streams:
            self.deadline_s = now + _SILENCE_S
            if self.received == count:
                self._end(now)
            return
        if self._asked.pop(index, None) is not None:
            self._ask(now)

    def _on_deadline(self, now: float) -> None:
        """Ask for what has not come."""
        if self._found:
            self._ask(now)
        elif self._lists < _LISTS:
            self.start(now)
        else:
            self._finish(OperationResult.TIMED_OUT, "the autopilot does not answer")

    def next_event(self) -> ParametersFinished | None:
        """Return and remove the end."""
        return self.events.popleft() if self.events else None

    def stop(self, result: OperationResult, reason: str, now: float) -> None:
        """End it for this reason."""
        if self.deadline_s is not None:
            self._finish(result, reason)

    def _ask(self, now: float) -> None:
        """Ask for the next that are missing, those that were asked for least first.

        As one answer comes, another is asked for: most of a lossy link's time went by in waiting
        for the last of a batch.
        """
        self._streams = False
        self._asked = {index: until for index, until in self._asked.items() if until > now}
        missing = [index for index in range(self.total) if index not in self._found]
        left = [
            index
            for index in missing
            if index not in self._asked and self._attempts.get(index, 0) < _ATTEMPTS
        ]
        nothing_new = now - self._new_s >= _NOTHING_NEW_S
        if nothing_new or not (left or self._asked):
            self._end(now)
            return
        left.sort(key=lambda index: self._attempts.get(index, 0))
        for index in sorted(left[: _AT_ONCE - len(self._asked)]):
            self._attempts[index] = self._attempts.get(index, 0) + 1
            self._asked[index] = now + _SILENCE_S
            self._send("PARAM_REQUEST_READ", param_id=b"", param_index=index)
        self.deadline_s = min(self._asked.values())

    def _end(self, now: float) -> None:
        missing = self.total - self.received
        if missing:
            text = f"{missing} of {self.total} parameters did not arrive"
            self._finish(OperationResult.TIMED_OUT, text)
        elif len({parameter.name for parameter in self._found.values()}) < self.total:
            self._restart(now)  # one has moved to another index
        else:
            self._finish(OperationResult.ACHIEVED, f"All {self.total} parameters were read.")

    def _restart(self, now: float) -> None:
        self._restarts += 1
        if self._restarts > _RESTARTS:
            text = "the number of parameters keeps changing"
            self._finish(OperationResult.REFUSED, text)
        else:
            self.start(now)

    def _finish(self, result: OperationResult, reason: str) -> None:
        self.deadline_s = None
        if result is not OperationResult.ACHIEVED:
            reason = f"Not all parameters were read: {reason}."
        found = sorted(self._found.values(), key=lambda parameter: parameter.name)
        self.events.append(ParametersFinished(result, reason, tuple(found)))

    def _send(self, name: str, **fields: object) -> None:
        target = {
            "target_system": self._address.target_system,
            "target_component": self._address.target_component,
        }
        self.outbox.append(make(name, **target, **fields))
