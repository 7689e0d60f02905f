"""Required autopilot parameters, read by name and kept up to date.

https://mavlink.io/en/services/parameter.html: PARAM_REQUEST_READ is answered by PARAM_VALUE,
and so is every change, to all links. For a parameter that they do not have, older releases of
ArduPilot and PX4 give no answer (observed), those of 2026 PARAM_ERROR, so a name without a value
after all repetitions counts as absent until it is asked for again. A change may also be made where
no PARAM_VALUE comes of it (ArduPilot's DO_FENCE_ENABLE), so everything is read again from time to
time.

A parameter that a newer release of the firmware calls otherwise is asked for by that name, too,
once the former one has had no answer, or an error. Its value is known by the former name, in that
one's unit.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Mapping
from types import MappingProxyType

from mavlink_vehicle.codec import Message, make, mavlink
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.service import Conversation, VehicleService
from mavlink_vehicle.state.vehicle_state import VehicleState

_VALUE = mavlink.MAVLink_param_value_message
_ERROR = mavlink.MAVLink_param_error_message
_RETRY_S = 1.0
_ATTEMPTS = 8
_AGAIN_S = 30.0
# OtherServers are asked for at somebody's request, not more often than this.
_ASK_S, _ASK_KNOWN_S = 1.0, 30.0

_NOT_RENAMED: Mapping[str, tuple[str, float]] = MappingProxyType({})
_INTEGERS = {
    mavlink.MAV_PARAM_TYPE_UINT8: "<Bxxx",
    mavlink.MAV_PARAM_TYPE_INT8: "<bxxx",
    mavlink.MAV_PARAM_TYPE_UINT16: "<Hxx",
    mavlink.MAV_PARAM_TYPE_INT16: "<hxx",
    mavlink.MAV_PARAM_TYPE_UINT32: "<I",
    mavlink.MAV_PARAM_TYPE_INT32: "<i",
}


def decode_value(message: mavlink.MAVLink_param_value_message, bytewise: bool) -> float:
    """Return the value of a PARAM_VALUE.

    Args:
        message: the PARAM_VALUE.
        bytewise: whether an integer's bytes stand in the float's place (PX4), instead of the
            float being the number (ArduPilot).
    """
    layout = _INTEGERS.get(message.param_type) if bytewise else None
    if layout is None:
        return float(message.param_value)
    return float(struct.unpack(layout, struct.pack("<f", message.param_value))[0])


class ParameterReader(VehicleService):
    """Reads the wanted parameters, and again every 30 s.

    Attributes:
        values: the known values, by name; read only.
    """

    handles = (_VALUE, _ERROR)

    def __init__(self) -> None:
        """Want nothing."""
        super().__init__()
        self._address: Address | None = None
        self._bytewise = False
        self._wanted: tuple[str, ...] = ()
        self._missing: list[str] = []
        self._values: dict[str, float] = {}
        self.values: Mapping[str, float] = MappingProxyType(self._values)
        self._others: dict[str, float] = {}
        self._asked_s: dict[str, float] = {}
        self._attempts = 0
        self._renamed = _NOT_RENAMED
        self._formerly: dict[str, tuple[str, float]] = {}
        self._has: dict[str, str] = {}

    def value(self, name: str) -> float | None:
        """Return a wanted value, or one that was asked for; None before it has come."""
        return self._values.get(name, self._others.get(name))

    @property
    def reading(self) -> bool:
        """Whether answers are still waited for."""
        return bool(self._missing)

    def vehicle_came(self, conversation: Conversation, now: float) -> None:
        """Read those that the profile needs."""
        profile = conversation.profile
        names = (
            *profile.wanted_parameters,
            *(name for name, _ in profile.equipment.absent.values()),
        )
        renamed = profile.renamed_parameters
        self.resume(conversation.address, names, profile.parameters_bytewise, now, renamed)

    def link_lost(self, state: VehicleState, now: float) -> None:
        """Stop asking."""
        self.pause()

    def vehicle_gone(self, reason: str, now: float) -> None:
        """Drop what is known."""
        self.forget()

    def resume(
        self,
        address: Address,
        names: Iterable[str],
        bytewise: bool,
        now: float,
        renamed: Mapping[str, tuple[str, float]] = _NOT_RENAMED,
    ) -> None:
        """Ask for these from now on; the known values stay until they are answered.

        Args:
            address: the vehicle's.
            names: the parameters.
            bytewise: see `decode_value`.
            now: the time.
            renamed: the names that newer releases have, each with what makes the former unit of it.
        """
        self._address, self._bytewise, self._renamed = address, bytewise, renamed
        self._formerly = {newer: (name, scale) for name, (newer, scale) in renamed.items()}
        self._wanted = tuple(names)
        self.refresh(now)

    def ask(self, names: Iterable[str], now: float) -> None:
        """Ask once for parameters besides the wanted ones; `value` has the answers.

        They are not among `values`, by which the vehicle is flown.

        It may be called as often as one likes: what is known is asked for every 30 s, what has
        not been answered every second.
        """
        if self._address is None or self.deadline_s is None:
            return
        for name in names:
            again_s = _ASK_KNOWN_S if name in self._others else _ASK_S
            if name not in self._wanted and now >= self._asked_s.get(name, -math.inf) + again_s:
                self._request(name, self._address, again=name in self._asked_s)
                self._asked_s[name] = now

    def read(self, names: Iterable[str], now: float) -> list[float | None]:
        """Return any parameters; those not known yet are None, and are asked for."""
        names = tuple(names)
        self.ask(names, now)
        return [self.value(name) for name in names]

    def refresh(self, now: float) -> None:
        """Read everything again."""
        self._missing = list(self._wanted)
        self._attempts = 0
        self.deadline_s = now if self._missing else None
        self.handle_timer(now)

    def forget(self) -> None:
        """Drop what is known: the autopilot restarted."""
        self._values.clear()
        self._others.clear()
        self._asked_s.clear()
        self._has.clear()

    def pause(self) -> None:
        """Stop asking."""
        self.deadline_s = None
        self.outbox.clear()

    def receive(self, message: Message, now: float) -> None:
        """Process a value, whoever asked for it or changed it."""
        if isinstance(message, _ERROR):
            self._ask_by_newer_name(message)
        if not isinstance(message, _VALUE):
            return
        name, scale = self._formerly.get(message.param_id, (message.param_id, 1.0))
        value = scale * decode_value(message, self._bytewise)
        if name in self._renamed:
            self._has[name] = message.param_id
        if name not in self._wanted:
            if name in self._asked_s:
                self._others[name] = value
            return
        self._values[name] = value
        if name in self._missing:
            self._missing.remove(name)
            if not self._missing:
                self.deadline_s = now + _AGAIN_S

    def _ask_by_newer_name(self, error: mavlink.MAVLink_param_error_message) -> None:
        name, is_unknown = error.param_id, error.error == mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST
        if is_unknown and name in self._renamed and self._address is not None:
            self._has[name] = self._renamed[name][0]
            self._request(name, self._address, again=False)

    def _on_deadline(self, now: float) -> None:
        """Ask for what is missing; give up after this many times, until the next reading."""
        if self._address is None:
            return
        if not self._missing:
            self.refresh(now)
            return
        if self._attempts >= _ATTEMPTS:
            self._missing.clear()
            self.deadline_s = now + _AGAIN_S
            return
        self._attempts += 1
        self.deadline_s = now + _RETRY_S
        for name in self._missing:
            self._request(name, self._address, again=self._attempts > 1)

    def _request(self, name: str, address: Address, again: bool) -> None:
        names = [self._has.get(name, name)]
        if again and name in self._renamed and name not in self._has:
            names.append(self._renamed[name][0])
        for each in names:
            self.outbox.append(
                make(
                    "PARAM_REQUEST_READ",
                    target_system=address.target_system,
                    target_component=address.target_component,
                    param_id=each.encode("ascii"),
                    param_index=-1,
                )
            )
