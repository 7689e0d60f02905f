"""The parameter service: list, read by name or index, set.

As recorded: an unknown name or index gets no answer at all; a value set on request is echoed
with index 65535; values travel as floats whatever their type.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.exchange import ParameterSaved
from mavlink_sitl.mavlink.codec import Message, dialect

LIST_PER_TICK = 20
"""A full list is sent in portions: 1,343 were recorded in 0.7 s, a tick is 10 ms"""
ECHO_INDEX = 65535


def saved_parameter(saved: ParameterSaved, parameters: Parameters) -> Message:
    """PARAM_VALUE for everybody, unasked: the firmware has saved one by itself."""
    return dialect.MAVLink_param_value_message(
        saved.name.encode("ascii"), saved.value, saved.type, len(parameters), ECHO_INDEX
    )


class ParameterServer:
    """Answers for one vehicle's parameters."""

    per_tick = LIST_PER_TICK

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._to_list: Sequence[str] = ()

    @property
    def busy(self) -> bool:
        """Whether a list is being sent."""
        return bool(self._to_list)

    def request_list(self) -> None:
        """PARAM_REQUEST_LIST: all of them from the beginning."""
        self._to_list = self._parameters.names()

    def take_portion(self) -> list[Message]:
        """The next part of a list in progress."""
        portion = self._to_list[: self.per_tick]
        self._to_list = self._to_list[self.per_tick :]
        return [self._indexed(name) for name in portion]

    def read(self, name: str, index: int) -> Message | None:
        """PARAM_REQUEST_READ: by index when it is not negative, else by name."""
        names = self._parameters.names()
        if index >= 0:
            return self._value(names[index], index) if index < len(names) else None
        return self._indexed(name) if name in self._parameters else None

    def set(self, name: str, value: float) -> Message | None:
        """PARAM_SET: the value in force afterwards; NaN and infinity change nothing."""
        if name not in self._parameters:
            return None
        if math.isfinite(value):
            self._parameters.set(name, value)
        return self._value(name, ECHO_INDEX)

    def _indexed(self, name: str) -> Message:
        index = self._parameters.index(name)
        return self._value(name, ECHO_INDEX if index is None else index)

    def _value(self, name: str, index: int) -> Message:
        spec = self._parameters.specs[name]
        return dialect.MAVLink_param_value_message(
            name.encode("ascii"), self._parameters[name], int(spec.type), len(self._parameters),
            index,
        )  # fmt: skip
