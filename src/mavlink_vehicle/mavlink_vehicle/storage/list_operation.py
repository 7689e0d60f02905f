"""Reads or writes a fence or the rally points; a failure leaves the former list, or is reported.

A list is read before another is written. The stored list is read again afterwards, whatever the
answer to the upload was, and compared. If it is not what was sent, it is sent again, a few times.
If it stays another one, or is rejected, the former list is put back, unless it is still there:
ArduPilot stores rally points as they come, so that an upload that breaks off leaves a mixture
(MissionItemProtocol_Rally.cpp), while a fence, and both lists of a PX4, are exchanged as a whole
(MissionItemProtocol_Fence.cpp, mavlink_mission.cpp).
"""

from __future__ import annotations

import enum
from collections.abc import Callable
from typing import ClassVar

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import OperationResult, StoredListFinished
from mavlink_vehicle.mission_items import MissionItem, MissionType, list_difference
from mavlink_vehicle.protocols.machine import Table
from mavlink_vehicle.protocols.mission.mission_clear import MissionClear
from mavlink_vehicle.protocols.mission.mission_download import MissionDownload
from mavlink_vehicle.protocols.mission.mission_upload import MissionUpload
from mavlink_vehicle.protocols.mission.transfer import (
    TransferFinished,
    TransferResult,
    TransferTiming,
)
from mavlink_vehicle.protocols.mission.transfers_in_turn import TransfersInTurn
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.operations.evidence import quote_texts
from mavlink_vehicle.state.reducer import VehicleState

_WRITES = 3
# Each transfer ends by itself; a link that loses half of everything is not waited for any longer.
_TIME_S = 100.0
_TIME_PER_ITEM_S = 0.6
_SUBJECTS = {MissionType.FENCE: "The fence was", MissionType.RALLY: "The rally points were"}


class ListState(enum.Enum):
    """The state of the state machine."""

    IDLE = "not started"
    READING = "reading the stored list"
    WRITING = "sending the new list"
    CHECKING = "reading back"
    RESTORING = "sending the former list"
    FINISHED = "ended"


class ListInput(enum.Enum):
    """An input of the state machine."""

    START = "start"
    READ = "the former list is known"
    WRITTEN = "the transfer ended, acknowledged or not"
    AGAIN = "the list read back differs; attempts remain"
    RESTORE = "neither the new list nor the former one is stored"
    END = "done"
    CANCEL = "cancelled, link lost, or timed out"


class ListOperation(TransfersInTurn[StoredListFinished]):
    """One reading or writing of a list; ends in exactly one `StoredListFinished`."""

    def __init__(
        self,
        kind: MissionType,
        items: tuple[MissionItem, ...] | None,
        address: Address,
        timing: TransferTiming,
        state: Callable[[], VehicleState],
    ) -> None:
        """Prepare; `start` sends.

        Args:
            kind: FENCE or RALLY.
            items: what is to be stored; None to read only.
            address: who talks with whom.
            timing: of each transfer.
            state: returns the vehicle's state, for its texts.
        """
        super().__init__(ListState.IDLE)
        self.kind = kind
        self._wanted = items
        self._address = address
        self._timing = timing
        self._vehicle = state
        self._texts_before = 0
        self._former: tuple[MissionItem, ...] = ()
        self._stored: tuple[MissionItem, ...] | None = None
        self._writes = 0
        self._restorations = 0
        self._rejected = False
        self._result = OperationResult.ACHIEVED
        self._reason = ""

    @property
    def writes(self) -> bool:
        """Whether it changes what is stored."""
        return self._wanted is not None

    def start(self, now: float) -> None:
        """Read what is stored."""
        items = len(self._wanted or ())
        self._limit_s = now + _TIME_S + _TIME_PER_ITEM_S * items
        self._texts_before = self._vehicle().texts.count
        self._fire(ListInput.START, now)

    def stop(self, result: OperationResult, reason: str, now: float) -> None:
        """End it for this reason; a MISSION_ACK ends a half-done transfer in the vehicle, too."""
        if self.state is ListState.FINISHED:
            return
        self._fail(result, reason)
        if self.state in (ListState.WRITING, ListState.CHECKING, ListState.RESTORING):
            self._stored = None
        self._fire(ListInput.CANCEL, now)

    # Called by its parts

    def _end_late(self, now: float) -> None:
        self.stop(OperationResult.TIMED_OUT, "timed out", now)

    def _transfer_ended(self, end: TransferFinished, now: float) -> None:
        if self.state is ListState.READING:
            self._know(end, now)
        elif self.state is ListState.CHECKING:
            self._compare(end, now)
        else:
            self._sent(end, now)

    def _know(self, end: TransferFinished, now: float) -> None:
        if end.result is not TransferResult.DONE:
            self._fail(_result_of(end), f"what is stored could not be read: {end.reason}")
            self._fire(ListInput.END, now)
            return
        self._former = self._stored = end.items
        self._fire(ListInput.READ if self.writes else ListInput.END, now)

    def _sent(self, end: TransferFinished, now: float) -> None:
        if self.state is ListState.WRITING:
            is_error = end.answer == mavlink.MAV_MISSION_ERROR
            self._reason = "the autopilot answered ERROR" if is_error else end.reason
            # An error after the last item may be the answer to its repetition, or be meant: then
            # the list is not accepted, whatever is read back.
            self._rejected = end.answer is not None
            self._result = _result_of(end)
            if end.result in (TransferResult.REFUSED, TransferResult.BUSY):
                self._writes = _WRITES
        self._fire(ListInput.WRITTEN, now)

    def _compare(self, end: TransferFinished, now: float) -> None:
        if end.result is not TransferResult.DONE:
            self._stored = None
            self._fail(_result_of(end), self._reason or f"reading it back: {end.reason}")
            self._fire(ListInput.END, now)
            return
        self._stored = end.items
        difference = list_difference(self._wanted or (), end.items, self.kind)
        if difference is None and not self._rejected:
            self._result, self._reason = OperationResult.ACHIEVED, ""
            self._fire(ListInput.END, now)
        elif self._writes < _WRITES and not self._restorations:
            self._fire(ListInput.AGAIN, now)
        else:
            if not self._reason and difference is not None:
                reason = f"the list read back differs from the list sent: {difference}"
                self._fail(OperationResult.REFUSED, reason)
            ends = self._is_former() or self._restorations >= _WRITES
            self._fire(ListInput.END if ends else ListInput.RESTORE, now)

    def _is_former(self) -> bool:
        stored = self._stored
        return stored is not None and list_difference(self._former, stored, self.kind) is None

    def _fail(self, result: OperationResult, reason: str) -> None:
        self._result, self._reason = result, reason

    # Actions

    def _read(self, now: float) -> None:
        self._begin_part(MissionDownload(self._address, self._timing, self.kind), now)

    def _send_list(self, items: tuple[MissionItem, ...], now: float) -> None:
        self._upload = None
        if not items:
            self._begin_part(MissionClear(self._address, self._timing, self.kind), now)
            return
        self._upload = MissionUpload(items, self._address, self._timing, self.kind)
        self._begin_part(self._upload, now)

    def _write(self, now: float) -> None:
        self._writes += 1
        self._send_list(self._wanted or (), now)

    def _restore(self, now: float) -> None:
        self._restorations += 1
        self._send_list(self._former, now)

    def _finish(self, now: float) -> None:
        if self._result is not OperationResult.ACHIEVED:
            self._give_up_part(now)
        self._part = self.deadline_s = None
        what = _SUBJECTS[self.kind]
        done = "written" if self.writes else "read"
        if self._result is OperationResult.ACHIEVED:
            read_back = " and read back" if self.writes else ""
            sentence = f"{what} {done}{read_back}: {_counted(self._stored or ())}."
        else:
            texts = quote_texts(self._vehicle(), self._texts_before)
            sentence = f"{what} not {done}: {self._reason}{texts}. {self._left()}"
        self.events.append(
            StoredListFinished(self.kind, self._result, sentence.rstrip(), self._stored)
        )

    def _left(self) -> str:
        """Return what is stored after a failure."""
        if not self._writes:
            return "Nothing was sent." if self.writes else ""
        if self._stored is None:
            return "What the autopilot stores now is unknown; read it before you fly."
        if self._is_former():
            how = "was restored" if self._restorations else "is still stored"
            return f"The former list ({_counted(self._former)}) {how}."
        return (
            f"The autopilot stores {_counted(self._stored)} that are neither the new nor the "
            "former list, which could not be restored; write it again before you fly."
        )

    _S = ListState
    _I = ListInput
    table: ClassVar[Table] = {
        (_S.IDLE, _I.START): (_S.READING, _read),
        (_S.IDLE, _I.CANCEL): (_S.FINISHED, _finish),
        (_S.READING, _I.READ): (_S.WRITING, _write),
        (_S.READING, _I.END): (_S.FINISHED, _finish),
        (_S.READING, _I.CANCEL): (_S.FINISHED, _finish),
        (_S.WRITING, _I.WRITTEN): (_S.CHECKING, _read),
        (_S.WRITING, _I.CANCEL): (_S.FINISHED, _finish),
        (_S.CHECKING, _I.AGAIN): (_S.WRITING, _write),
        (_S.CHECKING, _I.RESTORE): (_S.RESTORING, _restore),
        (_S.CHECKING, _I.END): (_S.FINISHED, _finish),
        (_S.CHECKING, _I.CANCEL): (_S.FINISHED, _finish),
        (_S.RESTORING, _I.WRITTEN): (_S.CHECKING, _read),
        (_S.RESTORING, _I.CANCEL): (_S.FINISHED, _finish),
    }
    del _S, _I


def _counted(items: tuple[MissionItem, ...]) -> str:
    return f"{len(items)} item{'' if len(items) == 1 else 's'}"


def _result_of(end: TransferFinished) -> OperationResult:
    answered = end.answer is not None and end.result is not TransferResult.GIVEN_UP
    rejected = answered or end.result is TransferResult.BUSY
    return OperationResult.REFUSED if rejected else OperationResult.TIMED_OUT
