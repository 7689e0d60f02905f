"""Reads one parameter, or changes it and reads it back.

https://mavlink.io/en/services/parameter.html: PARAM_SET is answered by PARAM_VALUE with what is in
force then. That may be an answer to an earlier message, so the value is read once more. ArduPilot
and PX4 of 2026 say in PARAM_ERROR what is wrong; older ones are silent about what they do not know
and, PX4, about another type (observed).
"""

from __future__ import annotations

import enum
import math

from mavlink_vehicle.codec import Message, make, mavlink
from mavlink_vehicle.events import (
    Parameter,
    ParameterChange,
    ParameterOutcome,
    parameter_text,
)
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.outbox import TimedOutbox
from mavlink_vehicle.storage.values import (
    encode_value,
    parameter_of,
    same_value,
    value_problem,
)

_VALUE = mavlink.MAVLink_param_value_message
_ERROR = mavlink.MAVLink_param_error_message
_RETRY_S = 0.5
# At a loss of 20 % each way one exchange in three fails: 12 of them once in 200,000 times.
_READS = 12
# An answer with another value may be an old one, on its way since before PARAM_SET: it decides
# nothing before this time.
_CHECK_S = 1.0
_SETS = 3
_ERRORS = {
    2: "the autopilot reports that the value is out of range",
    3: "the autopilot denies the change",
    4: "the autopilot has no such component",
    5: "it is read-only",
    6: "the autopilot does not support its type",
    7: "the autopilot reports a different type",
    8: "the autopilot cannot read it",
}
_UNKNOWN = 1


class _Step(enum.Enum):
    READING = "requesting its value"
    SETTING = "PARAM_SET was sent"
    CHECKING = "it is read back"
    FINISHED = "ended"


class OneParameter(TimedOutbox):
    """One parameter; ends in one `ParameterOutcome`."""

    def __init__(
        self,
        name: str,
        wanted: float | None,
        address: Address,
        bytewise: bool,
        known: Parameter | None = None,
    ) -> None:
        """Prepare; `start` sends.

        Args:
            name: its name.
            wanted: the value that it is to have; None to read it only.
            address: who talks with whom.
            bytewise: whether integers stand in the float as their bytes.
            known: what was just read of it.
        """
        super().__init__()
        self._name = name
        self._is_read_only = wanted is None
        self._wanted = math.nan if wanted is None else wanted
        self._address = address
        self._bytewise = bytewise
        self._old: Parameter | None = known
        self._new: Parameter | None = known
        self._step = _Step.READING
        self._reads = self._sets = 0
        self._differs: Parameter | None = None
        self._text_before = ""
        self.outcome: ParameterOutcome | None = None
        """How it ended; None before."""

    def start(self, now: float) -> None:
        """Read it, or judge what is known."""
        if self._old is None:
            self._read(now)
        else:
            self._judge(self._old, now)

    def receive(self, message: Message, now: float) -> None:
        """Look for its value, or for an error about it."""
        if self._step is _Step.FINISHED:
            return
        if message.__class__ is _VALUE and message.param_id.rstrip("\0") == self._name:
            self._take(parameter_of(message, self._bytewise), now)
        elif message.__class__ is _ERROR and message.param_id.rstrip("\0") == self._name:
            if not self._address.is_for_us(message):
                return
            if message.error == _UNKNOWN:
                self._end(ParameterChange.UNKNOWN, f"{self._name} is unknown to the autopilot.")
            else:
                reason = _ERRORS.get(message.error, f"PARAM_ERROR {message.error}")
                self._end(ParameterChange.FAILED, f"{self._name} was not changed: {reason}.")

    def _on_deadline(self, now: float) -> None:
        """Ask again, or give up."""
        if self._step is _Step.SETTING:
            self._check(now)
        elif self._differs is not None:
            self._set_again(self._differs, now)
        elif self._reads < _READS:
            self._read(now)
        elif self._step is _Step.READING:
            text = f"The autopilot did not report {self._name}; it may not have this parameter."
            self._end(ParameterChange.UNKNOWN, text)
        else:
            text = f"{self._name} was set, but could not be read back; its value is unknown."
            self._new = None
            self._end(ParameterChange.FAILED, text)

    def stop(self, reason: str) -> ParameterOutcome:
        """End it for this reason, part of a sentence, if it has not ended; returns how it ended."""
        if self.outcome is not None:
            return self.outcome
        text = f"{self._name} was not changed: {reason}."
        if self._sets:
            self._new = None
            text = f"{self._name} was set, but not read back: {reason}; its value is unknown."
        return self._end(ParameterChange.FAILED, text)

    def _take(self, parameter: Parameter, now: float) -> None:
        if self._step is _Step.READING:
            self._old = self._new = parameter
            self._judge(parameter, now)
        elif self._step is _Step.SETTING:
            self._check(now)
        else:
            self._compare(parameter)

    def _judge(self, parameter: Parameter, now: float) -> None:
        """Compare what it has with what it is to have."""
        self._text_before = parameter.text
        if self._is_read_only:
            text = f"{self._name} is {parameter.text}."
            self._end(ParameterChange.READ, text)
            return
        problem = value_problem(self._wanted, parameter.type, self._bytewise)
        if math.isfinite(self._wanted) and same_value(self._wanted, parameter):
            # Also a value that would not be set: a file of the vehicle's own may hold it.
            text = f"{self._name} is {parameter.text} already."
            self._end(ParameterChange.UNCHANGED, text)
        elif problem is not None:
            self._end(ParameterChange.FAILED, f"{self._name} was not changed: {problem}.")
        else:
            self._set(parameter.type, now)

    def _check(self, now: float) -> None:
        self._step, self._reads, self._differs = _Step.CHECKING, 0, None
        self._read(now)
        self.deadline_s = now + _CHECK_S

    def _compare(self, parameter: Parameter) -> None:
        self._new = parameter
        if not same_value(self._wanted, parameter):
            self._differs = parameter
        else:
            text = f"{self._name} is {parameter.text}, read back; it was {self._text_before}."
            self._end(ParameterChange.CHANGED, text)

    def _set_again(self, parameter: Parameter, now: float) -> None:
        if self._sets < _SETS:
            self._set(parameter.type, now)
        else:
            wanted = parameter_text(self._wanted)
            text = f"{self._name} is {parameter.text} after it was set to {wanted} {_SETS} times."
            self._end(ParameterChange.FAILED, text)

    def _set(self, kind: int, now: float) -> None:
        try:
            number = encode_value(self._wanted, kind, self._bytewise)
        except ValueError as error:
            self._end(ParameterChange.FAILED, f"{self._name} was not changed: {error}")
            return
        self._step = _Step.SETTING
        self._sets += 1
        self._send("PARAM_SET", now, param_value=number, param_type=kind)

    def _read(self, now: float) -> None:
        self._reads += 1
        self._send("PARAM_REQUEST_READ", now, param_index=-1)

    def _send(self, message: str, now: float, **fields: float) -> None:
        self.deadline_s = now + _RETRY_S
        self.outbox.append(
            make(
                message,
                target_system=self._address.target_system,
                target_component=self._address.target_component,
                param_id=self._name.encode("ascii"),
                **fields,
            )
        )

    def _end(self, change: ParameterChange, reason: str) -> ParameterOutcome:
        self._step, self.deadline_s = _Step.FINISHED, None
        outcome = ParameterOutcome(self._name, change, reason, self._old, self._new)
        self.outcome = outcome
        return outcome
