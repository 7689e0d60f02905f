"""Downloads a list of items: MISSION_REQUEST_LIST, then MISSION_REQUEST_INT for each.

Here we drive: what is not answered is asked for again. Acknowledgements that may belong to an
earlier upload are ignored; only UNSUPPORTED ends the reading. DENIED is what an ArduPilot says
while another station uploads: it is asked again until that is over.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import ClassVar

from mavlink_vehicle.codec import Message, make, mavlink
from mavlink_vehicle.mission_items import MissionItem, MissionType, item_of
from mavlink_vehicle.protocols.machine import Machine, Table
from mavlink_vehicle.protocols.mission.mission_parts import (
    ACCEPTED,
    BUSY_SENTENCE,
    CANCELLED,
    TransferResult,
    TransferTiming,
    ack_sentence,
    concerns,
)
from mavlink_vehicle.protocols.operations.command import Address

_MINE = frozenset({"MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ACK"})


@dataclass(frozen=True)
class DownloadFinished:
    """The one end of a download; `items` is all that is stored, home included where it counts."""

    result: TransferResult
    items: tuple[MissionItem, ...] = ()
    reason: str = ""


class DownloadState(enum.Enum):
    """The state of a download."""

    IDLE = "not started"
    LISTING = "the number of items is asked for"
    READING = "an item is asked for"
    FINISHED = "ended"


class DownloadInput(enum.Enum):
    """An input of a download."""

    START = "start"
    COUNT = "there are so many items"
    EMPTY = "there are none"
    ITEM = "the item that was asked for, and not the last"
    LAST = "the last item"
    REFUSED = "MISSION_ACK: not known"
    RETRY = "time is up, attempts are left"
    EXHAUSTED = "time is up, no attempts are left"
    CANCEL = "cancelled by us"


class MissionDownload(Machine[DownloadFinished]):
    """Reads one list; ends in exactly one `DownloadFinished`, unless it is cancelled."""

    def __init__(
        self,
        address: Address,
        timing: TransferTiming,
        mission_type: MissionType = MissionType.MISSION,
    ) -> None:
        """Prepare; `start` asks."""
        super().__init__(DownloadState.IDLE)
        self._address = address
        self._timing = timing
        self._type = mission_type
        self._left = timing.retries
        self._count = 0
        self._items: list[MissionItem] = []
        self._end = DownloadFinished(
            TransferResult.UNANSWERED, reason="the autopilot does not answer"
        )

    def start(self, now: float) -> None:
        """Ask how many items there are."""
        self._fire(DownloadInput.START, now)

    def cancel(self, now: float) -> None:
        """Stop asking; no event follows."""
        self._fire(DownloadInput.CANCEL, now)

    def receive(self, message: Message, now: float) -> None:
        """Look for the count, for items and for a rejection."""
        name = message.get_type()
        if self.state in (DownloadState.IDLE, DownloadState.FINISHED) or name not in _MINE:
            return
        if not concerns(message, self._address, self._type):
            return
        if name == "MISSION_ACK":
            if message.type == mavlink.MAV_MISSION_DENIED:
                self._end = DownloadFinished(TransferResult.BUSY, reason=BUSY_SENTENCE)
            elif message.type == mavlink.MAV_MISSION_UNSUPPORTED:
                reason = ack_sentence(message.type)
                self._end = DownloadFinished(TransferResult.REFUSED, reason=reason)
                self._fire(DownloadInput.REFUSED, now)
        elif name == "MISSION_COUNT":
            if self.state is DownloadState.LISTING:
                self._count = message.count
                self._left = self._timing.retries
                self._fire(DownloadInput.COUNT if self._count else DownloadInput.EMPTY, now)
        elif self.state is DownloadState.READING and message.seq == len(self._items):
            self._items.append(item_of(message))
            self._left = self._timing.retries
            last = len(self._items) == self._count
            self._fire(DownloadInput.LAST if last else DownloadInput.ITEM, now)

    def handle_timer(self, now: float) -> None:
        """Ask again or give up when it is time."""
        if self._deadline is None or now < self._deadline:
            return
        if self._left > 0:
            self._left -= 1
            self._fire(DownloadInput.RETRY, now)
        else:
            self._fire(DownloadInput.EXHAUSTED, now)

    def _send(self, name: str, **fields: int) -> None:
        self._outbox.append(
            make(
                name,
                target_system=self._address.target_system,
                target_component=self._address.target_component,
                mission_type=int(self._type),
                **fields,
            )
        )

    def _list(self, now: float) -> None:
        self._send("MISSION_REQUEST_LIST")
        self._deadline = now + self._timing.timeout_s

    def _ask(self, now: float) -> None:
        self._send("MISSION_REQUEST_INT", seq=len(self._items))
        self._deadline = now + self._timing.timeout_s

    def _succeed(self, now: float) -> None:
        self._send("MISSION_ACK", type=ACCEPTED)
        self._end = DownloadFinished(TransferResult.DONE, tuple(self._items))
        self._finish(now)

    def _finish(self, now: float) -> None:
        self._deadline = None
        self._events.append(self._end)

    def _stop(self, now: float) -> None:
        self._deadline = None
        self._outbox.clear()
        self._send("MISSION_ACK", type=CANCELLED)

    _S = DownloadState
    _I = DownloadInput
    table: ClassVar[Table] = {
        (_S.IDLE, _I.START): (_S.LISTING, _list),
        (_S.IDLE, _I.CANCEL): (_S.FINISHED, None),
        (_S.LISTING, _I.COUNT): (_S.READING, _ask),
        (_S.LISTING, _I.EMPTY): (_S.FINISHED, _succeed),
        (_S.LISTING, _I.REFUSED): (_S.FINISHED, _finish),
        (_S.LISTING, _I.RETRY): (_S.LISTING, _list),
        (_S.LISTING, _I.EXHAUSTED): (_S.FINISHED, _finish),
        (_S.LISTING, _I.CANCEL): (_S.FINISHED, _stop),
        (_S.READING, _I.ITEM): (_S.READING, _ask),
        (_S.READING, _I.LAST): (_S.FINISHED, _succeed),
        (_S.READING, _I.REFUSED): (_S.FINISHED, _finish),
        (_S.READING, _I.RETRY): (_S.READING, _ask),
        (_S.READING, _I.EXHAUSTED): (_S.FINISHED, _finish),
        (_S.READING, _I.CANCEL): (_S.FINISHED, _stop),
        (_S.FINISHED, _I.CANCEL): (_S.FINISHED, None),
    }
    del _S, _I
