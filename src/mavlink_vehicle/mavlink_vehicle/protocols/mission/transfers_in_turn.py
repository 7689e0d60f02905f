"""An operation made of transfers, one after another, within a time."""

from __future__ import annotations

from abc import abstractmethod
from typing import TypeVar

from mavlink_vehicle.codec import Message
from mavlink_vehicle.protocols.machine import Machine
from mavlink_vehicle.protocols.mission.mission_clear import MissionClear
from mavlink_vehicle.protocols.mission.mission_download import MissionDownload
from mavlink_vehicle.protocols.mission.mission_upload import MissionUpload
from mavlink_vehicle.protocols.mission.transfer import TransferFinished
from mavlink_vehicle.protocols.operations.command import CommandExchange, CommandFinished

Part = MissionUpload | MissionClear | MissionDownload | CommandExchange
_Event = TypeVar("_Event")


class TransfersInTurn(Machine[_Event]):
    """Runs its parts, and passes on what they send; a subclass decides what comes next."""

    _part: Part | None = None
    _upload: MissionUpload | None = None
    _limit_s = 0.0

    def receive(self, message: Message, now: float) -> None:
        """Process a message of the mission service, or an acknowledgement of a command."""
        if self._part is None:
            return
        if self._upload is not None and self._upload is not self._part:
            self._upload.receive(message, now)  # a transfer that a late MISSION_COUNT began again
            self.outbox += self._upload.messages_to_send()
        self._part.receive(message, now)
        self._step(self._part, now)

    def _on_deadline(self, now: float) -> None:
        """Repeat, or end."""
        if now >= self._limit_s:
            self._end_late(now)
        elif self._part is not None:
            self._part.handle_timer(now)
            self._step(self._part, now)

    def _begin_part(self, part: Part, now: float) -> None:
        self._part = part
        part.start(now)
        self._step(part, now)

    def _step(self, part: Part, now: float) -> None:
        self.outbox += part.messages_to_send()
        end = part.next_event()
        if end is None:
            times = (self._limit_s, part.deadline_s)
            self.deadline_s = min(time for time in times if time is not None)
        elif isinstance(end, CommandFinished):
            self._command_ended(end, now)
        else:
            self._transfer_ended(end, now)

    def _give_up_part(self, now: float) -> None:
        """Have the vehicle forget a half-done transfer."""
        if self._part is not None:
            self._part.cancel(now)
            self.outbox += self._part.messages_to_send()

    @abstractmethod
    def _transfer_ended(self, end: TransferFinished, now: float) -> None:
        """Process the end of the present part, a transfer."""

    def _command_ended(self, end: CommandFinished, now: float) -> None:
        """Process the end of a command; most operations begin none."""

    @abstractmethod
    def _end_late(self, now: float) -> None:
        """End it, since it timed out."""
