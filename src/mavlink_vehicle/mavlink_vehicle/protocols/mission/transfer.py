"""The base of the mission transfers: upload, download, clearing."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import ClassVar

from mavlink_vehicle.codec import make, mavlink
from mavlink_vehicle.mission_items import MissionItem, MissionType
from mavlink_vehicle.protocols.machine import Machine
from mavlink_vehicle.protocols.operations.command import Address

MissionAck = mavlink.MAVLink_mission_ack_message
_OfAList = (
    MissionAck
    | mavlink.MAVLink_mission_count_message
    | mavlink.MAVLink_mission_item_int_message
    | mavlink.MAVLink_mission_request_message
    | mavlink.MAVLink_mission_request_int_message
)
MISSION_ANSWERS = (
    mavlink.MAVLink_mission_request_message,
    mavlink.MAVLink_mission_request_int_message,
    mavlink.MAVLink_mission_count_message,
    mavlink.MAVLink_mission_item_int_message,
    mavlink.MAVLink_mission_ack_message,
)
"""The messages of an autopilot with whom a list is transferred."""
ACCEPTED = mavlink.MAV_MISSION_ACCEPTED
CANCELLED = mavlink.MAV_MISSION_OPERATION_CANCELLED

_SENTENCES = {
    mavlink.MAV_MISSION_ERROR: "the autopilot answered ERROR, as ArduPilot does in AUTO",
    mavlink.MAV_MISSION_UNSUPPORTED_FRAME: "the autopilot does not support the frame of an item",
    mavlink.MAV_MISSION_UNSUPPORTED: "the autopilot does not support an item's command or the list",
    mavlink.MAV_MISSION_NO_SPACE: "the autopilot has no space for that many items",
    mavlink.MAV_MISSION_INVALID: "the autopilot considers an item invalid",
    mavlink.MAV_MISSION_INVALID_PARAM1: "the autopilot does not accept param1 of an item",
    mavlink.MAV_MISSION_INVALID_PARAM2: "the autopilot does not accept param2 of an item",
    mavlink.MAV_MISSION_INVALID_PARAM3: "the autopilot does not accept param3 of an item",
    mavlink.MAV_MISSION_INVALID_PARAM4: "the autopilot does not accept param4 of an item",
    mavlink.MAV_MISSION_INVALID_PARAM5_X: "the autopilot does not accept the latitude of an item",
    mavlink.MAV_MISSION_INVALID_PARAM6_Y: "the autopilot does not accept the longitude of an item",
    mavlink.MAV_MISSION_INVALID_PARAM7: "the autopilot does not accept the altitude of an item",
    mavlink.MAV_MISSION_INVALID_SEQUENCE: "the autopilot has no item of that number",
    mavlink.MAV_MISSION_DENIED: "the autopilot denied it; another ground station may be using it",
    CANCELLED: "the autopilot cancelled the transfer because items did not arrive",
}

BUSY_SENTENCE = "the autopilot is busy, possibly with another ground station's transfer"


def ack_sentence(result: int) -> str:
    """Return what a MAV_MISSION_RESULT other than ACCEPTED means."""
    return _SENTENCES.get(result, f"the autopilot answered MAV_MISSION_RESULT {result}")


class TransferResult(enum.Enum):
    """The result of a transfer."""

    DONE = "the vehicle acknowledged it"
    REFUSED = "the vehicle rejected it"
    UNSURE = "all was sent, but not clearly acknowledged; the read-back decides"
    UNANSWERED = "no answer came"
    GIVEN_UP = "the vehicle gave up, because items were missing"
    BUSY = "the vehicle was busy with another ground station's transfer"


@dataclass(frozen=True)
class TransferTiming:
    """Timeouts and retries of a transfer.

    Attributes:
        timeout_s: time to the next repetition of what is not answered.
        retries: repetitions after the first sending, of each message separately. At 40 % loss both
            ways an exchange fails 64 times in 100, so that 20 repetitions fail once in 10,000
            and a mission of 50 exchanges once in 200; with 12 it was every sixth.
    """

    timeout_s: float = 0.5
    retries: int = 20

    @property
    def silence_s(self) -> float:
        """The longest silence of a vehicle that sends requests itself."""
        return self.timeout_s * (self.retries + 1)


@dataclass(frozen=True)
class TransferFinished:
    """The one end of a transfer.

    Attributes:
        result: how it ended.
        reason: why, to go into a sentence; empty when it is DONE.
        items: after a download all that is stored, home included where it counts.
        opaque_id: after an upload the vehicle's number for what it has now, None where it gives
            none.
        answer: the MAV_MISSION_RESULT that it ended with, None where none came or it was DONE.
    """

    result: TransferResult
    reason: str = ""
    items: tuple[MissionItem, ...] = ()
    opaque_id: int | None = None
    answer: int | None = None


class TransferInput(enum.Enum):
    """An input of a transfer."""

    START = "start"
    REQUEST = "requesting an item"
    COUNT = "the number of items"
    EMPTY = "no items"
    ITEM = "the requested item, not the last one"
    LAST = "the last item"
    ACCEPTED = "MISSION_ACK: accepted"
    REFUSED = "MISSION_ACK: anything else that ends it"
    RETRY = "timeout; attempts remain"
    EXHAUSTED = "timeout; no attempts remain"
    CANCEL = "cancelled by us"


class Transfer(Machine[TransferFinished]):
    """One list on its way; ends in exactly one `TransferFinished`, unless it is cancelled."""

    idle: ClassVar[enum.Enum]
    """The first state."""

    def __init__(
        self,
        address: Address,
        timing: TransferTiming,
        mission_type: MissionType = MissionType.MISSION,
    ) -> None:
        """Prepare; `start` sends.

        Args:
            address: who transfers with whom.
            timing: timeouts and retries.
            mission_type: the list.
        """
        super().__init__(self.idle)
        self._address = address
        self._timing = timing
        self._type = mission_type
        self._left = timing.retries
        reason = "the autopilot does not answer"
        self._end = TransferFinished(TransferResult.UNANSWERED, reason)

    def start(self, now: float) -> None:
        """Send the first message."""
        self._fire(TransferInput.START, now)

    def cancel(self, now: float) -> None:
        """Report to the vehicle that the transfer ends; no event follows."""
        self._fire(TransferInput.CANCEL, now)

    def _on_deadline(self, now: float) -> None:
        """Repeat or give up when it is time."""
        if self._left > 0:
            self._left -= 1
            self._fire(TransferInput.RETRY, now)
        else:
            self._fire(TransferInput.EXHAUSTED, now)

    @property
    def _target(self) -> tuple[int, int]:
        return self._address.target_system, self._address.target_component

    def _send(self, name: str, **fields: int) -> None:
        system, component = self._target
        self.outbox.append(
            make(
                name,
                target_system=system,
                target_component=component,
                mission_type=int(self._type),
                **fields,
            )
        )

    def _concerns_us(self, message: _OfAList) -> bool:
        """Whether a message of the mission service is the autopilot's, for us, of this list."""
        return (
            self._address.answers(message)
            and self._address.is_for_us(message)
            and message.mission_type == self._type
        )

    def _note_busy(self) -> None:
        """Keep on asking; unless something else comes, another station's transfer was the end."""
        self._end = TransferFinished(TransferResult.BUSY, BUSY_SENTENCE)

    def _refuse(
        self,
        ack: int,
        now: float,
        result: TransferResult = TransferResult.REFUSED,
        about: str = "",
    ) -> None:
        """End, as a MAV_MISSION_RESULT other than ACCEPTED says; `about` names what it is about."""
        self._end = TransferFinished(result, ack_sentence(ack) + about, answer=ack)
        self._fire(TransferInput.REFUSED, now)

    def _wait(self, now: float) -> None:
        """Expect an answer before the next repetition."""
        self.deadline_s = now + self._timing.timeout_s

    def _finish(self, now: float) -> None:
        self.deadline_s = None
        self.events.append(self._end)

    def _stop(self, now: float) -> None:
        super()._stop(now)
        self._send("MISSION_ACK", type=CANCELLED)
