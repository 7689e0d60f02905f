"""Writes, reads and clears the stored mission, confirmed by reading it back.

An acknowledgement is not enough: an upload can be acknowledged and stored in another form. So a
mission is written, read back and compared, and written again if it is another one, a few times.
A transfer that the vehicle gave up, or that came to a silent end, is begun again, too.

Where a new mission would continue at the number of the item that the old one had come to
(ArduPilot), it is set back to its first item.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import OperationFinished, OperationKind, OperationResult
from mavlink_vehicle.mission_items import (
    HOME_PLACEHOLDER,
    MissionItem,
    MissionRules,
    first_difference,
)
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
from mavlink_vehicle.protocols.operations.command import (
    Address,
    CommandExchange,
    CommandFinished,
    CommandRequest,
    CommandTiming,
    result_name,
)
from mavlink_vehicle.protocols.operations.evidence import Evidence
from mavlink_vehicle.protocols.operations.operation_goals import StateGoal
from mavlink_vehicle.state.reducer import VehicleState

_WRITES = 3
_REASONS_S = 0.5


@dataclass(frozen=True)
class MissionJob(StateGoal):
    """The job to do on the stored mission.

    Attributes:
        kind: UPLOAD_MISSION, DOWNLOAD_MISSION or CLEAR_MISSION.
        items: what is to be stored, without home; empty unless it is an upload.
        rules: what the firmware does with missions.
        vehicle_name: for sentences.
    """

    kind: OperationKind
    items: tuple[MissionItem, ...]
    rules: MissionRules
    vehicle_name: str


@dataclass(frozen=True)
class MissionTiming:
    """Timeouts: in total, of each message, and of the command."""

    timeout_s: float
    transfer: TransferTiming
    command: CommandTiming


class MissionOperationState(enum.Enum):
    """The state of the state machine."""

    IDLE = "not started"
    WRITING = "sending or clearing the mission"
    READING = "reading back"
    REWINDING = "resetting it to its first item"
    REFUSING = "rejected; waiting for reasons"
    FINISHED = "ended"


class MissionInput(enum.Enum):
    """An input of the state machine."""

    WRITE = "start, with something to write"
    READ = "start, with nothing to write"
    WRITTEN = "the writing ended, acknowledged or not"
    AGAIN = "it failed; attempts remain"
    RIGHT = "the intended mission is stored"
    REWIND = "the same, and it must be reset to its first item"
    FAILED = "rejected, or no attempts remain"
    WAITED = "the wait for reasons is over"
    TIME_UP = "the operation timed out"
    STOP = "cancelled, or the link is lost"


class MissionOperation(TransfersInTurn[OperationFinished]):
    """One operation on the stored mission; ends in exactly one `OperationFinished`."""

    def __init__(
        self, operation_id: int, goal: MissionJob, address: Address, timing: MissionTiming
    ) -> None:
        """Prepare; `begin` is the way in."""
        super().__init__(MissionOperationState.IDLE)
        self.operation_id = operation_id
        self.goal = goal
        self.stored: tuple[MissionItem, ...] | None = None
        """The mission that was read, without home; None before."""
        self._address = address
        self._timing = timing
        self.evidence = Evidence()
        self._reasons_s: float | None = None
        self._writes = 0
        self._result = OperationResult.CANCELLED
        self._reason = ""

    @property
    def finished(self) -> bool:
        """Whether it has ended."""
        return self.state is MissionOperationState.FINISHED

    def begin(self, state: VehicleState, connected: bool, now: float) -> None:
        """Write, or read if there is nothing to write.

        Args:
            state: the vehicle's state.
            connected: whether its HEARTBEAT is fresh.
            now: time in seconds.
        """
        self.evidence.begin(state, connected, -math.inf)
        self._limit_s = now + self._timing.timeout_s
        reads = self.goal.kind is OperationKind.DOWNLOAD_MISSION
        self._fire(MissionInput.READ if reads else MissionInput.WRITE, now)

    def observe(self, state: VehicleState, connected: bool, now: float) -> None:
        """Process the vehicle's new state, for its texts."""
        self.evidence.observe(state, connected)

    def excuse(self, gap_s: float) -> None:
        """Do not count a time in which we did not run."""
        self._limit_s += gap_s

    def stop(self, result: OperationResult, reason: str, now: float) -> None:
        """End it for this reason; a MISSION_ACK ends a half-done transfer, too."""
        self._result, self._reason = result, reason
        self._fire(MissionInput.STOP, now)

    def _on_deadline(self, now: float) -> None:
        """Repeat, or end."""
        if self._reasons_s is None:
            super()._on_deadline(now)
        else:
            self._fire(MissionInput.WAITED, now)

    # Called by its parts

    def _end_late(self, now: float) -> None:
        self._reason = "timed out"
        self._result = OperationResult.TIMED_OUT
        self._fire(MissionInput.TIME_UP, now)

    def _transfer_ended(self, end: TransferFinished, now: float) -> None:
        if isinstance(self._part, MissionDownload):
            self._read(end, now)
        else:
            self._written(end, now)

    def _written(self, end: TransferFinished, now: float) -> None:
        if end.result in (TransferResult.DONE, TransferResult.UNSURE):
            self._fire(MissionInput.WRITTEN, now)
        elif end.result in (TransferResult.REFUSED, TransferResult.BUSY):
            self._fail(OperationResult.REFUSED, end.reason, now)
        else:
            self._again(OperationResult.TIMED_OUT, end.reason, now)

    def _read(self, end: TransferFinished, now: float) -> None:
        if end.result is not TransferResult.DONE:
            refused = end.result in (TransferResult.REFUSED, TransferResult.BUSY)
            kind = OperationResult.REFUSED if refused else OperationResult.TIMED_OUT
            self._fail(kind, f"reading it back: {end.reason}", now)
            return
        rules = self.goal.rules
        self.stored = end.items[rules.offset :]
        if self.goal.kind is OperationKind.DOWNLOAD_MISSION:
            self._fire(MissionInput.RIGHT, now)
            return
        difference = first_difference(self.goal.items, self.stored, rules)
        if difference is not None:
            reason = f"the mission read back differs from the mission sent: {difference}"
            self._again(OperationResult.REFUSED, reason, now)
        elif any(text.startswith(rules.rejections) for text in self.evidence.texts):
            # A PX4 judges what it stored after the upload.
            self._fail(OperationResult.REFUSED, "it is stored, but will not be flown", now)
        elif rules.rewinds and self.goal.items:
            self._fire(MissionInput.REWIND, now)
        else:
            self._fire(MissionInput.RIGHT, now)

    def _command_ended(self, end: CommandFinished, now: float) -> None:
        if end.result == mavlink.MAV_RESULT_ACCEPTED:
            self._fire(MissionInput.RIGHT, now)
            return
        answer = "not answered" if end.result is None else f"answered {result_name(end.result)}"
        kind = OperationResult.TIMED_OUT if end.result is None else OperationResult.REFUSED
        self._fail(kind, f"the reset to its first item (DO_SET_MISSION_CURRENT) was {answer}", now)

    def _again(self, result: OperationResult, reason: str, now: float) -> None:
        if self._writes < _WRITES:
            self._fire(MissionInput.AGAIN, now)
        else:
            self._fail(result, reason, now)

    def _fail(self, result: OperationResult, reason: str, now: float) -> None:
        self._result, self._reason = result, reason
        self._fire(MissionInput.FAILED, now)

    # Actions

    def _write(self, now: float) -> None:
        self._writes += 1
        timing = self._timing.transfer
        if self.goal.kind is OperationKind.CLEAR_MISSION:
            self._begin_part(MissionClear(self._address, timing), now)
            return
        home = (HOME_PLACEHOLDER,) if self.goal.rules.home_first else ()
        items: Sequence[MissionItem] = (*home, *self.goal.items)
        self._upload = MissionUpload(items, self._address, timing)
        self._begin_part(self._upload, now)

    def _begin_reading(self, now: float) -> None:
        self._begin_part(MissionDownload(self._address, self._timing.transfer), now)

    def _rewind(self, now: float) -> None:
        request = CommandRequest(
            mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, (float(self.goal.rules.offset),)
        )
        # Nothing in the state would show it if only the answers were lost: ask as often as for
        # an item.
        timing = replace(self._timing.command, retries=self._timing.transfer.retries)
        self._begin_part(CommandExchange(request, self._address, timing), now)

    def _wait_for_reasons(self, now: float) -> None:
        self._part = None
        self._reasons_s = self.deadline_s = now + _REASONS_S

    def _achieve(self, now: float) -> None:
        count = len(self.stored or ())
        self._finish(OperationResult.ACHIEVED, f"{self._title()}: {count} items are stored.", now)

    def _give_reasons(self, now: float) -> None:
        self._give_up_part(now)
        result, reason = self._result, f"{self._title()} failed: {self._reason}"
        if result is OperationResult.TIMED_OUT and not self.evidence.connected:
            result, reason = OperationResult.LINK_LOST, f"{reason}, and no HEARTBEAT is received"
        self._finish(result, self.evidence.quoted(reason), now)

    def _title(self) -> str:
        title = self.goal.kind.value
        return f"{title[0].upper()}{title[1:]}"

    def _finish(self, result: OperationResult, reason: str, now: float) -> None:
        self.deadline_s = None
        self._part = self._upload = None
        self.events.append(OperationFinished(self.operation_id, self.goal.kind, result, reason))

    _S = MissionOperationState
    _I = MissionInput
    table: ClassVar[Table] = {
        (_S.IDLE, _I.WRITE): (_S.WRITING, _write),
        (_S.IDLE, _I.READ): (_S.READING, _begin_reading),
        (_S.IDLE, _I.STOP): (_S.FINISHED, _give_reasons),
        (_S.WRITING, _I.WRITTEN): (_S.READING, _begin_reading),
        (_S.WRITING, _I.AGAIN): (_S.WRITING, _write),
        (_S.WRITING, _I.FAILED): (_S.REFUSING, _wait_for_reasons),
        (_S.WRITING, _I.TIME_UP): (_S.FINISHED, _give_reasons),
        (_S.WRITING, _I.STOP): (_S.FINISHED, _give_reasons),
        (_S.READING, _I.RIGHT): (_S.FINISHED, _achieve),
        (_S.READING, _I.REWIND): (_S.REWINDING, _rewind),
        (_S.READING, _I.AGAIN): (_S.WRITING, _write),
        (_S.READING, _I.FAILED): (_S.REFUSING, _wait_for_reasons),
        (_S.READING, _I.TIME_UP): (_S.FINISHED, _give_reasons),
        (_S.READING, _I.STOP): (_S.FINISHED, _give_reasons),
        (_S.REWINDING, _I.RIGHT): (_S.FINISHED, _achieve),
        (_S.REWINDING, _I.FAILED): (_S.REFUSING, _wait_for_reasons),
        (_S.REWINDING, _I.TIME_UP): (_S.FINISHED, _give_reasons),
        (_S.REWINDING, _I.STOP): (_S.FINISHED, _give_reasons),
        (_S.REFUSING, _I.WAITED): (_S.FINISHED, _give_reasons),
        (_S.REFUSING, _I.STOP): (_S.FINISHED, _give_reasons),
        (_S.FINISHED, _I.STOP): (_S.FINISHED, None),
    }
    del _S, _I
