"""Clears a list: MISSION_CLEAR_ALL, repeated until it is acknowledged.

An ArduPilot that flies its mission answers ERROR and keeps it; a PX4 obeys, and loiters. DENIED
is what an ArduPilot says while another station uploads: it is asked again until that is over.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import ClassVar

from mavlink_vehicle.codec import Message, make, mavlink
from mavlink_vehicle.mission_items import MissionType
from mavlink_vehicle.protocols.machine import Machine, Table
from mavlink_vehicle.protocols.mission.mission_parts import (
    ACCEPTED,
    BUSY_SENTENCE,
    TransferResult,
    TransferTiming,
    ack_sentence,
    concerns,
)
from mavlink_vehicle.protocols.operations.command import Address


@dataclass(frozen=True)
class ClearFinished:
    """The one end of it; `reason` is empty when it is DONE."""

    result: TransferResult
    reason: str = ""


class ClearState(enum.Enum):
    """The state of the state machine."""

    IDLE = "not started"
    ASKING = "sent, not answered"
    FINISHED = "ended"


class ClearInput(enum.Enum):
    """An input of the state machine."""

    START = "start"
    ACCEPTED = "MISSION_ACK: accepted"
    REFUSED = "MISSION_ACK: anything else"
    RETRY = "time is up, attempts are left"
    EXHAUSTED = "time is up, no attempts are left"
    CANCEL = "cancelled by us"


class MissionClear(Machine[ClearFinished]):
    """Empties one list; ends in exactly one `ClearFinished`, unless it is cancelled."""

    def __init__(
        self,
        address: Address,
        timing: TransferTiming,
        mission_type: MissionType = MissionType.MISSION,
    ) -> None:
        """Prepare; `start` sends."""
        super().__init__(ClearState.IDLE)
        self._address = address
        self._timing = timing
        self._type = mission_type
        self._left = timing.retries
        self._end = ClearFinished(TransferResult.UNANSWERED, "the autopilot does not answer")

    def start(self, now: float) -> None:
        """Ask for it."""
        self._fire(ClearInput.START, now)

    def cancel(self, now: float) -> None:
        """Stop asking; no event follows."""
        self._fire(ClearInput.CANCEL, now)

    def receive(self, message: Message, now: float) -> None:
        """Look for the acknowledgement."""
        if self.state is not ClearState.ASKING or message.get_type() != "MISSION_ACK":
            return
        if not concerns(message, self._address, self._type):
            return
        if message.type == ACCEPTED:
            self._end = ClearFinished(TransferResult.DONE)
            self._fire(ClearInput.ACCEPTED, now)
        elif message.type == mavlink.MAV_MISSION_DENIED:
            self._end = ClearFinished(TransferResult.BUSY, BUSY_SENTENCE)
        else:
            self._end = ClearFinished(TransferResult.REFUSED, ack_sentence(message.type))
            self._fire(ClearInput.REFUSED, now)

    def handle_timer(self, now: float) -> None:
        """Repeat or give up when it is time."""
        if self._deadline is None or now < self._deadline:
            return
        self._left -= 1
        self._fire(ClearInput.EXHAUSTED if self._left < 0 else ClearInput.RETRY, now)

    def _send(self, now: float) -> None:
        self._outbox.append(
            make(
                "MISSION_CLEAR_ALL",
                target_system=self._address.target_system,
                target_component=self._address.target_component,
                mission_type=int(self._type),
            )
        )
        self._deadline = now + self._timing.timeout_s

    def _finish(self, now: float) -> None:
        self._deadline = None
        self._events.append(self._end)

    def _stop(self, now: float) -> None:
        self._deadline = None
        self._outbox.clear()

    _S = ClearState
    _I = ClearInput
    table: ClassVar[Table] = {
        (_S.IDLE, _I.START): (_S.ASKING, _send),
        (_S.IDLE, _I.CANCEL): (_S.FINISHED, None),
        (_S.ASKING, _I.ACCEPTED): (_S.FINISHED, _finish),
        (_S.ASKING, _I.REFUSED): (_S.FINISHED, _finish),
        (_S.ASKING, _I.RETRY): (_S.ASKING, _send),
        (_S.ASKING, _I.EXHAUSTED): (_S.FINISHED, _finish),
        (_S.ASKING, _I.CANCEL): (_S.FINISHED, _stop),
        (_S.FINISHED, _I.CANCEL): (_S.FINISHED, None),
    }
    del _S, _I
