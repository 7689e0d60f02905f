"""Uploads a list of items: MISSION_COUNT, then each requested item, until MISSION_ACK.

The vehicle drives: it asks for items, again if they don't come, and in whatever way its
firmware does (ArduPilot with MISSION_REQUEST, which is answered with MISSION_ITEM_INT all the
same; PX4 with MISSION_REQUEST_INT). Only the first message is ours to repeat.

- Requests and acknowledgements for another ground station, or of another list, are ignored.
- ACCEPTED before the last item was sent belongs to something earlier, and is ignored.
- DENIED (ArduPilot) and ERROR (PX4) instead of the first request mean that another station's
  transfer is in progress: the offer is repeated until that is over.
- INVALID_SEQUENCE only says that an item came twice or late; the vehicle asks on.
- A result about one item is about the one that was sent last: the reason names that one, counted
  from 0.
- An error after the last item may be the answer to its repetition, when all is stored already
  (ArduPilot): the result is UNSURE, and reading back decides.
- Requests that come after the end are still answered: a repeated MISSION_COUNT may have begun
  the transfer again.
"""

from __future__ import annotations

import enum
from collections.abc import Sequence
from typing import ClassVar

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.mission_items import MissionItem, MissionType, opaque_id
from mavlink_vehicle.protocols.machine import Table
from mavlink_vehicle.protocols.mission.transfer import (
    ACCEPTED,
    CANCELLED,
    MissionAck,
    Transfer,
    TransferFinished,
    TransferInput,
    TransferResult,
    TransferTiming,
)
from mavlink_vehicle.protocols.operations.command import Address, command_name

_REQUESTS = (
    mavlink.MAVLink_mission_request_message,
    mavlink.MAVLink_mission_request_int_message,
)
_BUSY = (mavlink.MAV_MISSION_DENIED, mavlink.MAV_MISSION_ERROR)
_OF_ITEM = frozenset(
    {
        mavlink.MAV_MISSION_UNSUPPORTED_FRAME,
        mavlink.MAV_MISSION_UNSUPPORTED,
        *range(mavlink.MAV_MISSION_INVALID, mavlink.MAV_MISSION_INVALID_PARAM7 + 1),
    }
)
"""Results that are about one item, the one that was sent last"""
_UNCLEAR = (mavlink.MAV_MISSION_ERROR, CANCELLED)


class UploadState(enum.Enum):
    """The state of an upload."""

    IDLE = "not started"
    OFFERING = "number of items sent, none requested yet"
    SENDING = "items are being requested"
    FINISHED = "ended"


class MissionUpload(Transfer):
    """Sends one list."""

    idle = UploadState.IDLE

    def __init__(
        self,
        items: Sequence[MissionItem],
        address: Address,
        timing: TransferTiming,
        mission_type: MissionType = MissionType.MISSION,
    ) -> None:
        """Prepare; `start` sends. The items are all that is stored, with home where it counts."""
        super().__init__(address, timing, mission_type)
        self._items = tuple(items)
        self._wanted = 0
        self._last_sent = not items

    def cancel(self, now: float) -> None:
        """Report to the vehicle that the transfer ends; no event follows.

        An ArduPilot has cut its stored mission to the new length by then.
        """
        super().cancel(now)

    def receive(self, message: Message, now: float) -> None:
        """Look for requests and for the acknowledgement."""
        if self.state is UploadState.IDLE or not isinstance(message, (*_REQUESTS, MissionAck)):
            return
        if not self._concerns_us(message):
            return
        if isinstance(message, MissionAck):
            self._acknowledged(message, now)
        elif message.seq < len(self._items):
            self._wanted = message.seq
            self._fire(TransferInput.REQUEST, now)

    def _acknowledged(self, message: MissionAck, now: float) -> None:
        result = message.type
        if self.state is UploadState.FINISHED or result == mavlink.MAV_MISSION_INVALID_SEQUENCE:
            return
        if result == ACCEPTED:
            if self._last_sent:
                self._end = TransferFinished(TransferResult.DONE, opaque_id=opaque_id(message))
                self._fire(TransferInput.ACCEPTED, now)
            return
        if self.state is UploadState.OFFERING and self._items and result in _BUSY:
            self._note_busy()
            return
        kind = TransferResult.REFUSED
        if result in _UNCLEAR and self._last_sent:
            kind = TransferResult.UNSURE
        elif result == CANCELLED:
            kind = TransferResult.GIVEN_UP
        self._refuse(result, now, kind, self._item_named() if result in _OF_ITEM else "")

    def _item_named(self) -> str:
        """Name the item that came before an answer about one."""
        if self.state is not UploadState.SENDING:
            return ""
        name = command_name(self._items[self._wanted].command)
        return f" (item {self._wanted} of the {len(self._items)} sent, {name})"

    def _on_deadline(self, now: float) -> None:
        """Repeat or give up when it is time."""
        if self.state is UploadState.OFFERING and self._left > 0:
            self._left -= 1
            self._fire(TransferInput.RETRY, now)
            return
        if self.state is UploadState.SENDING and self._last_sent:
            reason = "the autopilot did not acknowledge the last item"
            self._end = TransferFinished(TransferResult.UNSURE, reason)
        elif self.state is UploadState.SENDING or self._end.result is not TransferResult.BUSY:
            reason = "the autopilot does not answer"
            self._end = TransferFinished(TransferResult.UNANSWERED, reason)
        self._fire(TransferInput.EXHAUSTED, now)

    def _offer(self, now: float) -> None:
        self._send("MISSION_COUNT", count=len(self._items))
        self._wait(now)

    def _give(self, now: float) -> None:
        self._send_wanted()
        self.deadline_s = now + self._timing.silence_s

    def _send_wanted(self) -> None:
        item = self._items[self._wanted]
        self.outbox.append(item.message(self._wanted, self._target, self._type))
        self._last_sent = self._last_sent or self._wanted == len(self._items) - 1

    def _give_late(self, now: float) -> None:
        if self._end.result in (TransferResult.DONE, TransferResult.UNSURE):
            self._send_wanted()

    def _finish(self, now: float) -> None:
        self.outbox.clear()
        super()._finish(now)

    _S = UploadState
    _I = TransferInput
    table: ClassVar[Table] = {
        (_S.IDLE, _I.START): (_S.OFFERING, _offer),
        (_S.IDLE, _I.CANCEL): (_S.FINISHED, None),
        (_S.OFFERING, _I.REQUEST): (_S.SENDING, _give),
        (_S.OFFERING, _I.ACCEPTED): (_S.FINISHED, _finish),
        (_S.OFFERING, _I.REFUSED): (_S.FINISHED, _finish),
        (_S.OFFERING, _I.RETRY): (_S.OFFERING, _offer),
        (_S.OFFERING, _I.EXHAUSTED): (_S.FINISHED, _finish),
        (_S.OFFERING, _I.CANCEL): (_S.FINISHED, Transfer._stop),
        (_S.SENDING, _I.REQUEST): (_S.SENDING, _give),
        (_S.SENDING, _I.ACCEPTED): (_S.FINISHED, _finish),
        (_S.SENDING, _I.REFUSED): (_S.FINISHED, _finish),
        (_S.SENDING, _I.EXHAUSTED): (_S.FINISHED, _finish),
        (_S.SENDING, _I.CANCEL): (_S.FINISHED, Transfer._stop),
        (_S.FINISHED, _I.REQUEST): (_S.FINISHED, _give_late),
        (_S.FINISHED, _I.CANCEL): (_S.FINISHED, None),
    }
    del _S, _I
