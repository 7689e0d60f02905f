"""Downloads a list of items: MISSION_REQUEST_LIST, then MISSION_REQUEST_INT for each.

Here we drive: what is not answered is asked for again. Acknowledgements that may belong to an
earlier upload are ignored; only UNSUPPORTED ends the reading. DENIED is what an ArduPilot says
while another station uploads: it is asked again until that is over.
"""

from __future__ import annotations

import enum
from typing import ClassVar

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.mission_items import MissionItem, item_of
from mavlink_vehicle.protocols.machine import Table
from mavlink_vehicle.protocols.mission.transfer import (
    ACCEPTED,
    MissionAck,
    Transfer,
    TransferFinished,
    TransferInput,
    TransferResult,
)

_Count = mavlink.MAVLink_mission_count_message
_Item = mavlink.MAVLink_mission_item_int_message


class DownloadState(enum.Enum):
    """The state of a download."""

    IDLE = "not started"
    LISTING = "requesting the number of items"
    READING = "requesting an item"
    FINISHED = "ended"


class MissionDownload(Transfer):
    """Reads one list."""

    idle = DownloadState.IDLE

    def start(self, now: float) -> None:
        """Ask how many items there are."""
        self._count = 0
        self._items: list[MissionItem] = []
        super().start(now)

    def receive(self, message: Message, now: float) -> None:
        """Look for the count, for items and for a rejection."""
        if self.state in (DownloadState.IDLE, DownloadState.FINISHED):
            return
        if not isinstance(message, (_Count, _Item, MissionAck)):
            return
        if not self._concerns_us(message):
            return
        if isinstance(message, MissionAck):
            if message.type == mavlink.MAV_MISSION_DENIED:
                self._note_busy()
            elif message.type == mavlink.MAV_MISSION_UNSUPPORTED:
                self._refuse(message.type, now)
        elif isinstance(message, _Count):
            if self.state is DownloadState.LISTING:
                self._count = message.count
                self._left = self._timing.retries
                self._fire(TransferInput.COUNT if self._count else TransferInput.EMPTY, now)
        elif self.state is DownloadState.READING and message.seq == len(self._items):
            self._items.append(item_of(message))
            self._left = self._timing.retries
            last = len(self._items) == self._count
            self._fire(TransferInput.LAST if last else TransferInput.ITEM, now)

    def _list(self, now: float) -> None:
        self._send("MISSION_REQUEST_LIST")
        self._wait(now)

    def _ask(self, now: float) -> None:
        self._send("MISSION_REQUEST_INT", seq=len(self._items))
        self._wait(now)

    def _succeed(self, now: float) -> None:
        self._send("MISSION_ACK", type=ACCEPTED)
        self._end = TransferFinished(TransferResult.DONE, items=tuple(self._items))
        self._finish(now)

    _S = DownloadState
    _I = TransferInput
    table: ClassVar[Table] = {
        (_S.IDLE, _I.START): (_S.LISTING, _list),
        (_S.IDLE, _I.CANCEL): (_S.FINISHED, None),
        (_S.LISTING, _I.COUNT): (_S.READING, _ask),
        (_S.LISTING, _I.EMPTY): (_S.FINISHED, _succeed),
        (_S.LISTING, _I.REFUSED): (_S.FINISHED, Transfer._finish),
        (_S.LISTING, _I.RETRY): (_S.LISTING, _list),
        (_S.LISTING, _I.EXHAUSTED): (_S.FINISHED, Transfer._finish),
        (_S.LISTING, _I.CANCEL): (_S.FINISHED, Transfer._stop),
        (_S.READING, _I.ITEM): (_S.READING, _ask),
        (_S.READING, _I.LAST): (_S.FINISHED, _succeed),
        (_S.READING, _I.REFUSED): (_S.FINISHED, Transfer._finish),
        (_S.READING, _I.RETRY): (_S.READING, _ask),
        (_S.READING, _I.EXHAUSTED): (_S.FINISHED, Transfer._finish),
        (_S.READING, _I.CANCEL): (_S.FINISHED, Transfer._stop),
        (_S.FINISHED, _I.CANCEL): (_S.FINISHED, None),
    }
    del _S, _I
