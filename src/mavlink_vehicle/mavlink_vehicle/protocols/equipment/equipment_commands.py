"""Commands for the vehicle's equipment, one after the other, each with its answer."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import replace

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import EquipmentAnswered
from mavlink_vehicle.profiles.equipment import EquipmentCommand
from mavlink_vehicle.protocols.operations.command import (
    ACCEPTED,
    Address,
    CommandExchange,
    CommandRequest,
    CommandTiming,
    command_name,
    result_name,
)
from mavlink_vehicle.protocols.slot import Slot
from mavlink_vehicle.state.vehicle_state import VehicleState

__all__ = ["EquipmentCommands"]

_LIMIT_S = 5.0
_UNKNOWN = frozenset({mavlink.MAV_RESULT_UNSUPPORTED})


class EquipmentCommands(Slot[CommandExchange]):
    """Sends commands for equipment; each request ends in one `EquipmentAnswered`."""

    handles = (mavlink.MAVLink_command_ack_message, mavlink.MAVLink_heartbeat_message)
    hears_companions = True  # a camera of its own answers itself
    # The answer is taken in the turn of the request, also where no message brought it.
    asked_directly = True

    def __init__(self, address: Callable[[], Address | None], timing: CommandTiming) -> None:
        """Prepare.

        Args:
            address: the addresses of the conversation; None without a vehicle.
            timing: timeouts and repetitions of a command.
        """
        super().__init__()
        self._address = address
        self._timing = CommandTiming(timing.timeout_s, timing.retries, _LIMIT_S, _LIMIT_S)
        self._number = 0
        self._photos = 0
        self._commands: deque[EquipmentCommand] = deque()
        self._camera: int | None = None

    def receive(self, message: Message, now: float) -> None:
        """Take an answer, or learn of a camera that is a component of its own."""
        if not isinstance(message, mavlink.MAVLink_heartbeat_message):
            super().receive(message, now)
        elif message.type == mavlink.MAV_TYPE_CAMERA:
            self._camera = message._header.srcComponent

    def send(self, number: int, commands: Iterable[EquipmentCommand], now: float) -> None:
        """Send commands in their order; the last one's answer is that of the request.

        A request that is under way is given up, with an answer.

        Args:
            number: of the request, for its answer.
            commands: at least one.
            now: time in seconds.
        """
        self._fail("another request came", now)
        self._number, self._commands = number, deque(commands)
        self._send_next(now)
        self._set_deadline()

    def count_photo(self) -> int:
        """Return the number of another photo: a camera takes each number once."""
        self._photos += 1
        return self._photos

    @property
    def is_busy(self) -> bool:
        """Whether a request is under way."""
        return self.pending is not None

    def link_lost(self, state: VehicleState, now: float) -> None:
        """Answer that the vehicle is not heard."""
        self._fail("the link to the vehicle was lost", now)

    def vehicle_gone(self, reason: str, now: float) -> None:
        """Answer that the vehicle is not there any more, and forget its camera."""
        self._camera = None
        self._fail(reason, now)

    def _fail(self, reason: str, now: float) -> None:
        if self.pending is not None:
            self.pending.cancel(now)
            self.pending = None
            self._commands.clear()
            self._set_deadline()
            self.events.append(EquipmentAnswered(self._number, reason))

    def _send_next(self, now: float) -> None:
        address = self._address()
        if address is None:
            self._commands.clear()
            self.events.append(EquipmentAnswered(self._number, "there is no vehicle"))
            return
        if self._commands[0].to_camera and self._camera is not None:
            address = replace(address, target_component=self._camera)
        request = _request(self._commands[0])
        self.pending = CommandExchange(request, address, self._timing)
        self.pending.start(now)

    def _take_done(self, now: float) -> None:
        if self.pending is None or (finished := self.pending.next_event()) is None:
            return
        self._vacate()
        command, result = self._commands.popleft(), finished.result
        if result in _UNKNOWN and command.older is not None:
            self._commands.appendleft(command.older)
        if result is None and command.needs_answer:
            self._commands.clear()
        if self._commands:
            self._send_next(now)
            return
        failure = ""
        if result is None:
            failure = f"{command_name(command.command)} was not answered"
        elif result != ACCEPTED:
            failure = f"{command_name(command.command)} was answered with {result_name(result)}"
        self.events.append(EquipmentAnswered(self._number, failure))


def _request(command: EquipmentCommand) -> CommandRequest:
    if command.place is None:
        return CommandRequest(command.command, command.params)
    latitude_deg, longitude_deg, altitude_m = command.place
    head = (*command.params, *([0.0] * (4 - len(command.params))))
    place = (round(latitude_deg * 1e7), round(longitude_deg * 1e7), altitude_m)
    return CommandRequest(command.command, (*head, *place), mavlink.MAV_FRAME_GLOBAL)
