"""Clears a list: MISSION_CLEAR_ALL, repeated until it is acknowledged.

An ArduPilot that flies its mission answers ERROR and keeps it; a PX4 obeys, and loiters. DENIED
is what an ArduPilot says while another station uploads: it is asked again until that is over.
"""

from __future__ import annotations

import enum
from typing import ClassVar

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.protocols.machine import Machine, Table
from mavlink_vehicle.protocols.mission.transfer import (
    ACCEPTED,
    MissionAck,
    Transfer,
    TransferFinished,
    TransferInput,
    TransferResult,
)


class ClearState(enum.Enum):
    """The state of the state machine."""

    IDLE = "not started"
    ASKING = "sent, not answered"
    FINISHED = "ended"


class MissionClear(Transfer):
    """Empties one list."""

    idle = ClearState.IDLE

    def receive(self, message: Message, now: float) -> None:
        """Look for the acknowledgement."""
        if self.state is not ClearState.ASKING or not isinstance(message, MissionAck):
            return
        if not self._concerns_us(message):
            return
        if message.type == ACCEPTED:
            self._end = TransferFinished(TransferResult.DONE)
            self._fire(TransferInput.ACCEPTED, now)
        elif message.type == mavlink.MAV_MISSION_DENIED:
            self._note_busy()
        else:
            self._refuse(message.type, now)

    def _ask(self, now: float) -> None:
        self._send("MISSION_CLEAR_ALL")
        self._wait(now)

    _S = ClearState
    _I = TransferInput
    table: ClassVar[Table] = {
        (_S.IDLE, _I.START): (_S.ASKING, _ask),
        (_S.IDLE, _I.CANCEL): (_S.FINISHED, None),
        (_S.ASKING, _I.ACCEPTED): (_S.FINISHED, Transfer._finish),
        (_S.ASKING, _I.REFUSED): (_S.FINISHED, Transfer._finish),
        (_S.ASKING, _I.RETRY): (_S.ASKING, _ask),
        (_S.ASKING, _I.EXHAUSTED): (_S.FINISHED, Transfer._finish),
        (_S.ASKING, _I.CANCEL): (_S.FINISHED, Machine._stop),
        (_S.FINISHED, _I.CANCEL): (_S.FINISHED, None),
    }
    del _S, _I
